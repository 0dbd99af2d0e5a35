"""Files that appear complete or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from udd.errors import UddError


def made_folder(path: str | os.PathLike[str]) -> Path:
    """Return a folder to write to; it and those above it are made if needed.

    Raises
    ------
    UddError
        It cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UddError(f"the folder {folder} cannot be made: {error.strerror}") from None
    return folder


def require_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before the work for it begins.

    Raises
    ------
    UddError
        There is no such folder, no file can be made in it, or the path is a folder.
    """
    target = Path(path)
    try:  # rights alone do not say it: a file system may be full, read-only, or refuse the name
        if target.is_dir():
            raise UddError(f"{target} is a folder, not a file to write to")
        if not target.parent.is_dir():
            raise UddError(f"{target}: there is no folder {target.parent}")
        os.unlink(_new_file(target, ""))
    except OSError as error:
        raise UddError(f"{target} cannot be written: {error.strerror}") from None


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file in one go; what stood there before stays until the new one is complete.

    Raises
    ------
    UddError
        There is no such folder, it may not be written to, the path is a folder, or the disk is full.
    """
    target = Path(path)
    require_writable(target)
    try:
        with replacing(target) as name, open(name, "wb") as file:
            file.write(content)
    except OSError as error:
        raise UddError(f"{target} cannot be written: {error.strerror}") from None


@contextlib.contextmanager
def replacing(target: Path, suffix: str = "") -> Iterator[str]:
    """Yield the name of an empty file to fill, which takes the place of `target` where nothing fails.

    It lies in the same folder, and is on the disk before it takes that place, so that a loss of power leaves
    the old file or the new one.

    Raises
    ------
    OSError
        It cannot be written.
    """
    name = _new_file(target, suffix)
    try:
        yield name
        _to_disk(name, os.O_RDWR)
        os.replace(name, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise
    with contextlib.suppress(OSError):  # a folder cannot be opened on Windows, nor synchronised everywhere
        _to_disk(target.parent, os.O_RDONLY)


def _new_file(target: Path, suffix: str) -> str:
    """Make an empty file next to the target; the system takes the user's umask from its mode."""
    while True:
        name = target.parent / f".{target.name}.{secrets.token_hex(6)}{suffix}"
        try:
            os.close(os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            continue
        except ValueError:  # a null character
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL)) from None
        return str(name)


def _to_disk(path: str | Path, flags: int) -> None:
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
