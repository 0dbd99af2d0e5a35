"""Folders of uploads and results that do not outlive the server for long, however it ended.

Each server has one folder in the temporary folder, with a file on which it holds a lock. The system drops the
lock when the process dies, even by SIGKILL; the next server that starts deletes folders that nobody locks.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

_PREFIX = "udd-app-"
_LOCK = "lock"


@contextlib.contextmanager
def workspace() -> Iterator[Path]:
    """Make a folder that only this user can read, deleted at the end; delete those of dead servers."""
    remove_abandoned(Path(tempfile.gettempdir()))
    folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
    lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        with contextlib.suppress(OSError):  # a file system without locks; nobody deletes folders there
            _lock(lock)
        yield folder
    finally:
        os.close(lock)
        shutil.rmtree(folder, ignore_errors=True)


def remove_abandoned(temporary: Path) -> None:
    """Delete folders of servers that are dead, if this user made them."""
    for folder in temporary.glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):
            if _is_abandoned(folder):
                shutil.rmtree(folder, ignore_errors=True)


def _is_abandoned(folder: Path) -> bool:
    """Return True if nobody holds the folder's lock."""
    if folder.is_symlink() or (hasattr(os, "getuid") and folder.stat().st_uid != os.getuid()):
        return False
    lock = os.open(folder / _LOCK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    try:
        _lock(lock)
    finally:
        os.close(lock)
    return True


def _lock(file: int) -> None:
    """Lock a file until it is closed.

    Raises
    ------
    OSError
        Another process holds the lock.
    """
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
