"""The project's one `njit`, and dispatch on the type of the body inside compiled code.

Compiled code is cached on disk in a directory named by a hash of the sources that it is made from: an edited
kernel can never meet a stale copy of a helper from another file, and an edited picture costs nothing.

The cache is a pickle: whoever can write it can run code as its reader. It is therefore kept only where nobody but
the user can write; elsewhere the process compiles into a temporary directory of its own.
"""
import atexit
import contextlib
import functools
import os
import shutil
import stat
import tempfile
import warnings
from pathlib import Path

import numba
import platformdirs
from numba.core.caching import FunctionCache
from numba.extending import overload

from vesdyn.provenance import kernels_hash

# Contraction and reassociation only: NaN and infinity must keep their meaning, they detect failure.
_FAST_MATH = {"contract", "reassoc", "arcp", "nsz"}
_TEMPORARY = "VESDYN_TEMPORARY_CACHE"  # the variable that hands the directory of a process on to its workers


def cache_directory(parent, name):
    """Make the directory ``name`` in ``parent`` and return why it cannot hold compiled code, or None if it can.

    Only the user may be able to write in it, and to rename it or a directory above it.
    """
    directory = Path(parent).absolute() / name
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        directory.mkdir(mode=0o700, exist_ok=True)
        directory = directory.resolve()
        if fault := _intruder(directory):
            return fault
        with tempfile.TemporaryFile(dir=directory):
            return None
    except OSError as error:
        return f"{error.filename or directory}: {error.strerror or error}"


def _intruder(directory):
    """A sentence on who else might write in ``directory``, or None."""
    status = directory.stat()
    if status.st_uid != os.geteuid():
        return f"{directory} belongs to another user"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"others may write in {directory}"
    for above in directory.parents:
        status = above.stat()
        if status.st_uid not in (0, os.geteuid()):
            return f"{above} belongs to another user"
        others = status.st_mode & stat.S_IWOTH or (status.st_mode & stat.S_IWGRP and not _private(status.st_gid))
        if others and not status.st_mode & stat.S_ISVTX:
            return f"others may write in {above}"
    for inside in directory.rglob("*"):
        with contextlib.suppress(FileNotFoundError):  # another process of the user has just renamed it
            if inside.lstat().st_uid != os.geteuid():
                return f"{inside} belongs to another user"
    return None


def _private(group):
    """True where nobody but the user is in ``group``, as on systems that give each user a group of his own."""
    import grp
    import pwd

    try:
        user = pwd.getpwuid(os.geteuid()).pw_name
        entry = grp.getgrgid(group)
    except KeyError:
        return False
    return entry.gr_name == user and set(entry.gr_mem) <= {user}


def _choose_cache():
    """The directory for compiled code: that of the environment or of the user, else a temporary one."""
    name = kernels_hash(numba.__version__)
    if parent := os.environ.get(_TEMPORARY):
        if cache_directory(parent, name) is None:
            return str(Path(parent) / name)
    parent = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("vesdyn")
    fault = cache_directory(parent, name)
    if fault is None:
        return str(Path(parent).absolute() / name)
    temporary = tempfile.mkdtemp(prefix="vesdyn-")
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    os.environ[_TEMPORARY] = temporary
    warnings.warn(
        f"compiled code is kept for this time only, since {fault}; set NUMBA_CACHE_DIR to a directory that is yours"
        " alone.",
        stacklevel=2,
    )
    return str(Path(temporary) / name)


numba.config.CACHE_DIR = _choose_cache()

# Kernels are inlined into their callers: a call would go to whichever copy of the callee was loaded first, and
# copies that were optimised in different surroundings differ in the last bits.
_OPTIONS = {"fastmath": _FAST_MATH, "error_model": "numpy", "forceinline": True}

_FOREIGN = set()  # names of the kinds that are registered from outside the package


class _Cache(FunctionCache):
    """The cache of one kernel, passed by for arguments that hold a foreign kind: its kernels are in no hash of ours."""

    def load_overload(self, sig, target_context):
        return None if _holds_foreign(sig) else super().load_overload(sig, target_context)

    def save_overload(self, sig, data):
        if not _holds_foreign(sig):
            super().save_overload(sig, data)


def _holds_foreign(sig):
    return any(name in str(sig) for name in _FOREIGN)


def njit(function):
    """Compile ``function`` when it is first called, and keep what is compiled in the cache of the package."""
    kernel = numba.njit(cache=True, **_OPTIONS)(function)
    kernel._cache = _Cache(function)
    return kernel


def by_type(signature):
    """Turn ``signature`` (a function ``f(kind, ...)`` without a body of its own) into a generic function.

    A kind is a named tuple: a membrane, a traction law. Each registers its kernel with ``@f.register(Kind)``; a
    compiled caller then gets the kernel of its argument's type, as ``functools.singledispatch`` does in plain Python.
    A kind from outside the package is welcome; what is compiled for it is not kept for the next process.
    """
    generic = functools.singledispatch(signature)
    register = generic.register

    def noted(kind, kernel=None):
        if not kind.__module__.startswith("vesdyn."):
            _FOREIGN.add(kind.__name__)
        return register(kind, kernel)

    generic.register = noted

    @overload(generic, strict=False, jit_options=_OPTIONS)
    def choose(kind, *arguments):
        kernel = generic.dispatch(kind.instance_class)
        return getattr(kernel, "py_func", kernel)

    return generic

