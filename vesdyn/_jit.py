"""The project's one `njit`, and dispatch on the type of the body inside compiled code.

Compiled code is cached on disk in a directory named by a hash of the sources that it is made from: an edited
kernel can never meet a stale copy of a helper from another file, and an edited picture costs nothing.
"""
import ast
import functools
import hashlib
import os
from pathlib import Path

import numba
import platformdirs
from numba.extending import overload

# Contraction and reassociation only: NaN and infinity must keep their meaning, they detect failure.
_FAST_MATH = {"contract", "reassoc", "arcp", "nsz"}


def compiled_modules(package):
    """Source files of the ``package`` (a directory) that compile kernels, and of all that these import from it."""
    sources = {file.stem: file.read_text() for file in Path(package).glob("*.py")}
    found, wanted = set(), [name for name, text in sources.items() if name == "_jit" or "from vesdyn._jit import" in text]
    while wanted:
        name = wanted.pop()
        if name in sources and name not in found:
            found.add(name)
            wanted += _imports(sources[name])
    return [Path(package) / f"{name}.py" for name in sorted(found)]


def _imports(source):
    """Names that may be modules of this package in the imports of the text ``source``."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "vesdyn":
            yield from [node.module.removeprefix("vesdyn.")] if "." in node.module else [a.name for a in node.names]


def _sources_hash():
    digest = hashlib.sha256(numba.__version__.encode())
    for source in compiled_modules(Path(__file__).parent):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(Path(platformdirs.user_cache_dir("vesdyn")) / _sources_hash())

# Kernels are inlined into their callers: a call would go to whichever copy of the callee was loaded first, and
# copies that were optimised in different surroundings differ in the last bits.
_OPTIONS = {"fastmath": _FAST_MATH, "error_model": "numpy", "forceinline": True}

njit = functools.partial(numba.njit, cache=True, **_OPTIONS)


def by_type(signature):
    """Turn ``signature`` (a function ``f(kind, ...)`` without a body of its own) into a generic function.

    A kind is a named tuple: a membrane, a traction law. Each registers its kernel with ``@f.register(Kind)``; a
    compiled caller then gets the kernel of its argument's type, as ``functools.singledispatch`` does in plain Python.
    """
    generic = functools.singledispatch(signature)

    @overload(generic, strict=False, jit_options=_OPTIONS)
    def choose(kind, *arguments):
        kernel = generic.dispatch(kind.instance_class)
        return getattr(kernel, "py_func", kernel)

    return generic


by_body = by_type
