"""The project's one `njit`, and dispatch on the type of the body inside compiled code.

Compiled code is cached on disk in a directory named by a hash of all sources: an edited kernel can
never meet a stale copy of a helper from another file.
"""
import functools
import hashlib
import os
from pathlib import Path

import numba
import platformdirs
from numba.extending import overload

# Contraction and reassociation only: NaN and infinity must keep their meaning, they detect failure.
_FAST_MATH = {"contract", "reassoc", "arcp", "nsz"}


def _sources_hash():
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(Path(platformdirs.user_cache_dir("vesdyn")) / _sources_hash())

# Kernels are inlined into their callers: a call would go to whichever copy of the callee was loaded first, and
# copies that were optimised in different surroundings differ in the last bits.
_OPTIONS = {"fastmath": _FAST_MATH, "error_model": "numpy", "forceinline": True}

njit = functools.partial(numba.njit, cache=True, **_OPTIONS)


def by_body(signature):
    """Turn ``signature`` (a function ``f(body, ...)`` without a body of its own) into a generic function.

    A body is a named tuple of arrays. Each kind registers its kernel with ``@f.register(Kind)``; a compiled
    caller then gets the kernel of its body's type, as ``functools.singledispatch`` does in plain Python.
    """
    generic = functools.singledispatch(signature)

    @overload(generic, strict=False, jit_options=_OPTIONS)
    def choose(body, *arguments):
        kernel = generic.dispatch(body.instance_class)
        return getattr(kernel, "py_func", kernel)

    return generic
