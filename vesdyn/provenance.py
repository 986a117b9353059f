"""What computed a result: the hash of the sources, the versions, the commit.

One hash stands for every line that decides a number. A checkpoint, a finished run, a worker of a cluster and the
cache of compiled code are all compared by it, so that none of another version is used in silence.
"""

import ast
import datetime
import functools
import hashlib
import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

import vesdyn

PACKAGE = Path(__file__).parent
# Modules that draw, speak, store or start, and decide no number. Every other module counts, a new one too.
BYSTANDERS = frozenset(
    {
        "__main__", "batch", "calibration", "cli", "emulator", "ensemble", "files", "inference", "inference_file",
        "inference_report", "interrupts", "pictures", "provenance", "quantities", "results", "run", "storage", "study",
    }  # fmt: skip
)
_LIBRARIES = ("numba", "numpy", "scipy")


def sources_hash():
    """Hash of every module that decides a number, as these were when this process began."""
    return _SOURCES


def kernels_hash(compiler):
    """Hash of the modules that compiled code is made from, and of the ``compiler`` (text)."""
    return hash_of(compiled_modules(PACKAGE), compiler)[:16]


def hash_of(files, beside=""):
    """Hash of the names and contents of ``files``, in any order, and of the text ``beside``."""
    digest = hashlib.sha256(beside.encode())
    for file in sorted(files):
        content = file.read_bytes()
        digest.update(f"{file.name} {len(content)};".encode())
        digest.update(content)
    return digest.hexdigest()


def compiled_modules(package):
    """Source files of ``package`` (a directory) that compile kernels, and all that these import from it."""
    sources = {file.stem: file.read_text(encoding="utf-8") for file in Path(package).glob("*.py")}
    kernels = [name for name, text in sources.items() if name == "_jit" or "from vesdyn._jit import" in text]
    return imported_modules(package, kernels)


def imported_modules(package, names):
    """Source files of the modules ``names`` of ``package`` and all that these import from it."""
    sources = {file.stem: file.read_text(encoding="utf-8") for file in Path(package).glob("*.py")}
    found, wanted = set(), list(names)
    while wanted:
        name = wanted.pop()
        if name in sources and name not in found and name != "provenance":
            found.add(name)
            wanted += _imports(sources[name])
    return [Path(package) / f"{name}.py" for name in sorted(found)]


def _imports(source):
    """Names that may be modules of this package in the imports of the text ``source``."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "vesdyn":
            yield from [node.module.removeprefix("vesdyn.")] if "." in node.module else [a.name for a in node.names]


_SOURCES = hash_of(file for file in PACKAGE.glob("*.py") if file.stem not in BYSTANDERS)


@functools.cache
def _versions():
    return {library: version(library) for library in _LIBRARIES}


def provenance():
    """What computes here and now: date, versions, hash of the sources, and their commit if there is one."""
    return {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "vesdyn": vesdyn.__version__,
        "commit": _commit(),
        "sources": sources_hash(),
        "python": platform.python_version(),
        **_versions(),
        "machine": platform.machine(),
    }


def identity():
    """Version, hash of the sources and libraries of this process, as a cluster's workers are compared by."""
    return {
        "vesdyn": vesdyn.__version__,
        "sources": sources_hash(),
        **_versions(),
    }


def cores():
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@functools.cache
def _commit():
    """Git commit of the package's sources, ``-dirty`` if changed since, or None if not under git."""

    def git(*arguments):
        command = ["git", "-C", PACKAGE, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", Path(__file__).name)  # an installed copy inside another project's tree
        return git("describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")
    except (OSError, subprocess.SubprocessError):
        return None
