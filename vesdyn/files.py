"""Files that are written whole or not at all, by plain calls that raise.

A file is replaced by one atomic move of a copy that has reached the disk, and the directory is synced after it. HDF5
files are built in memory: the library loses errors of the disk when it releases small data sets. Each begins with a
block of 512 bytes, which HDF5 passes over, with the checksum of all that follows; it is compared before the library
sees a byte, since damaged files crash it.
"""

import errno
import hashlib
import io
import os
import stat
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np

from vesdyn.errors import RunError
from vesdyn.refusals import LONGEST, printable

PART = ".part"  # ends the name of a file that is being written
_BLOCK = 512  # bytes before an HDF5 image
_MARK = b"vesdyn sha256 "
_MARK_LINE = len(_MARK) + 64 + 1
_REASONS = {
    errno.ENOSPC: ("the disk is full", "make room"),
    errno.EDQUOT: ("the quota of the disk is used up", "make room"),
    errno.EROFS: ("the disk is read-only", "make it writable"),
    errno.EACCES: ("writing is not allowed", "allow it"),
    errno.EPERM: ("writing is not allowed", "allow it"),
    errno.EIO: ("the disk fails", "have it checked"),
}
_CANNOT_SYNC = {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EBADF}  # of directories, on some file systems


class WriteError(RunError):
    """A file that could not be written; the sentence names it and says what helps."""


class Damage(ValueError):
    """A file that is not as it was written."""


def write_error(directory, name, error):
    """The `WriteError` for the OSError ``error`` at the file ``name`` of ``directory``."""
    reason, remedy = _REASONS.get(error.errno, (error.strerror or str(error), "put that right"))
    return WriteError(f"{printable(str(directory), LONGEST)}: {reason} ({name}); {remedy} and give the same command again.")


def replace_file(directory, name, content, kept_as=None):
    """Put ``content`` (bytes) in the place of the file ``name`` of ``directory`` in one atomic move.

    The earlier file is moved to the name ``kept_as``, if that is given. Raises WriteError if any call fails; the
    earlier file is then still there, under one of its names.
    """
    file, part = directory / name, directory / f"{name}{PART}"
    try:
        try:
            handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o666)
            try:
                write_all(handle, content)
                sync(handle)
            finally:
                os.close(handle)
            if kept_as and file.exists():
                os.replace(file, directory / kept_as)
            os.replace(part, file)
        except BaseException:
            with suppress(OSError):
                os.unlink(part)
            raise
        sync_directory(file.parent)
    except OSError as error:
        raise write_error(directory, name, error) from None


def read(file):
    """The bytes of the regular ``file`` (a path); raise OSError, also where it is a pipe or a device, without end."""
    check_regular(file)
    return Path(file).read_bytes()


def check_regular(file):
    """Raise OSError where ``file`` (a path) is no regular file."""
    if not stat.S_ISREG(os.stat(file).st_mode):
        raise OSError(errno.EINVAL, "Is not a regular file", str(file))


def write_all(handle, content):
    """Write all of ``content`` (bytes) to the descriptor ``handle``."""
    left = memoryview(content)
    while left:
        left = left[os.write(handle, left) :]


def sync(handle):
    """Wait until what was written to the descriptor ``handle`` is on the disk."""
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):  # the file system has no such call
            raise


def sync_directory(directory):
    """Wait until the names in ``directory`` are on the disk."""
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in _CANNOT_SYNC:
            raise
    finally:
        os.close(handle)


def why_no_directory(path):
    """The clause that says why no directory to write in can be at ``path``, and what to do; None if one can."""
    for place in (path, *path.absolute().parents):
        try:
            is_directory = stat.S_ISDIR(os.stat(place).st_mode)
        except FileNotFoundError:
            if os.path.islink(place):
                return f"{printable(str(place), LONGEST)} is a link to nothing; choose another --out."
            continue
        except NotADirectoryError:
            continue
        except OSError as error:
            return f"{error.strerror}; choose another --out."
        shown = printable(str(place), LONGEST)
        if not is_directory:
            return f"{shown} is a file, not a directory; choose another --out."
        return None if os.access(place, os.W_OK | os.X_OK) else f"nothing may be written in {shown}; allow it or choose another --out."


def make_directory(directory, name="."):
    """Make the directory ``name`` in ``directory`` if need be; raise WriteError where that fails."""
    try:
        os.makedirs(directory / name, exist_ok=True)
    except OSError as error:
        raise write_error(directory, name, error) from None


def remove_file(directory, name):
    """Remove the file ``name`` of ``directory`` if it is there; raise WriteError where that fails."""
    try:
        os.unlink(directory / name)
    except FileNotFoundError:
        pass
    except OSError as error:
        raise write_error(directory, name, error) from None


# HDF5 in memory ------------------------------------------------------------------------------------------


def image(arrays, attributes, head=""):
    """The bytes of an HDF5 file of ``arrays`` (names to values or to (value, attributes)) and ``attributes``.

    ``head`` is a line of text that `read_head` finds without reading the rest.
    """
    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=_BLOCK) as file:
        for name, value in arrays.items():
            value, beside = value if isinstance(value, tuple) else (value, {})
            file[name] = value
            file[name].attrs.update(beside)
        file.attrs.update(attributes)
    covered = f"{head}\n".encode().ljust(_BLOCK - _MARK_LINE, b"\n") + memory.getvalue()[_BLOCK:]
    return _MARK + checksum(covered).encode() + b"\n" + covered


def checksum(content):
    """SHA-256 of ``content`` (bytes), as text."""
    return hashlib.sha256(content).hexdigest()


def image_checksum(content):
    """The checksum that the HDF5 image ``content`` carries; raise `Damage` unless it is right."""
    stored = checksum(memoryview(content)[_MARK_LINE:])
    if content[:_MARK_LINE] != _MARK + stored.encode() + b"\n":
        raise Damage("is damaged")
    return stored


def read_head(file):
    """The ``head`` of the image in ``file`` (a path), not compared with its checksum; raise `Damage` without one."""
    return _block(file)[_MARK_LINE:].split(b"\n", 1)[0].decode(errors="replace")


def carried_checksum(file):
    """The checksum in the image in ``file`` (a path), not compared with the rest; raise `Damage` without one."""
    return _block(file)[len(_MARK) : _MARK_LINE - 1].decode(errors="replace")


def _block(file):
    check_regular(file)
    with open(file, "rb") as opened:
        block = opened.read(_BLOCK)
    if len(block) < _BLOCK or not block.startswith(_MARK):
        raise Damage("is damaged")
    return block


def read_image(content):
    """Arrays, the attributes of each, and those of the file, of the HDF5 image ``content``.

    Scalars are floats and ints. Raises `Damage` unless every byte is as it was written.
    """
    image_checksum(content)
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            arrays = {name: _plain(dataset[()]) for name, dataset in file.items()}
            beside = {name: dict(dataset.attrs) for name, dataset in file.items()}
            return arrays, beside, {name: _plain(value) for name, value in file.attrs.items()}
    except (OSError, KeyError, ValueError, RuntimeError):
        raise Damage("is damaged") from None


def _plain(value):
    return value if isinstance(value, np.ndarray | str) else value.item()
