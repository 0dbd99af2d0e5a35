"""Files that appear complete or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

from udd.errors import UddError


def made_folder(path: str | os.PathLike[str]) -> Path:
    """A folder to write to, made with those above it if it is not there.

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
        There is no such folder, it may not be written to, or the path is a folder.
    """
    target = Path(path)
    if target.is_dir():
        raise UddError(f"{target} is a folder, not a file to write to")
    if not target.parent.is_dir():
        raise UddError(f"{target}: there is no folder {target.parent}")
    if not os.access(target.parent, os.W_OK):
        raise UddError(f"{target} cannot be written: {os.strerror(errno.EACCES)}")


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file in one go; what stood there before stays until the new one is complete.

    Raises
    ------
    UddError
        There is no such folder, it may not be written to, or the path is a folder.
    """
    target = Path(path)
    require_writable(target)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise UddError(f"{target} cannot be written: {error.strerror}") from None
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(name, 0o666 & ~umask)
        os.replace(name, target)
    except OSError as error:
        os.unlink(name)
        raise UddError(f"{target} cannot be written: {error.strerror}") from None
    except BaseException:
        os.unlink(name)
        raise
