"""Files that are read: regular ones, with a limit on what their content takes in memory."""

from __future__ import annotations

import errno
import math
import os
import re
import stat
from pathlib import Path
from typing import IO

import numpy as np

from udd.errors import UddError

LARGEST = 10**9
"""Bytes of data that a reader unpacks, unless its caller says otherwise."""
NESTED = 100
"""Bytes of memory that a byte of JSON may take, at most."""


class MemoryLimit:
    """Bytes that the content of a file may still take.

    Parameters
    ----------
    limit : float, optional
        Bytes; by default `LARGEST`, if the public function has no argument `limit` that allows more.
    error : type
        Kind of `UddError` to raise.

    Raises
    ------
    UddError
        `limit` is no positive number.

    Examples
    --------
    >>> memory = MemoryLimit(100)
    >>> memory.take(60)
    >>> memory.take(60)
    Traceback (most recent call last):
    ...
    udd.errors.UddError: the data take more than the limit of 100 bytes (limit=1e3 allows more)
    """

    def __init__(self, limit: float | None = None, error: type[UddError] = UddError) -> None:
        self.is_argument = limit is not None
        limit = LARGEST if limit is None else limit
        number = isinstance(limit, int | float | np.integer | np.floating) and not isinstance(limit, bool)
        if not (number and 1 <= limit < math.inf):
            raise error(f"limit must be a positive number of bytes, not {limit!r:.80}")
        self.limit, self.left, self.error = int(limit), int(limit), error

    def take(self, size: int) -> None:
        """Count bytes, before they are allocated.

        Raises
        ------
        UddError
            They are more than are left.
        """
        self.check(size)
        self.left -= size

    def check(self, size: int) -> None:
        """Refuse more bytes than are left, without counting them; errors as by :meth:`take`."""
        if size > self.left:
            raise self.exceeded()

    def exceeded(self) -> UddError:
        """Return the error of data that are too large."""
        advice = re.sub(r"e\+0*", "e", f" (limit={10.0 * min(self.limit, 1e300):.0e} allows more)")
        said = f"the data take more than the limit of {in_bytes(self.limit)}"
        return self.error(said + advice * self.is_argument)


def in_bytes(size: float) -> str:
    """Return a number of bytes in words, such as ``1.5 GB``."""
    for unit, name in ((1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size >= unit:
            return f"{size / unit:.3g} {name}"
    return f"{size:.0f} bytes"


def read_regular(path: str | os.PathLike[str], memory: MemoryLimit) -> bytes:
    """Read the bytes of a regular file; neither a device nor a pipe is waited for.

    Raises
    ------
    OSError
        It cannot be opened or read.
    UddError
        It is not a regular file, or larger than the limit.
    """
    with _opened(Path(path)) as file:
        kind = os.fstat(file.fileno())
        if not stat.S_ISREG(kind.st_mode):
            raise memory.error("is a device or a pipe, not a regular file: save its content to a file first")
        memory.check(kind.st_size)
        content = file.read(memory.left + 1)  # it may grow meanwhile
    memory.take(len(content))
    return content


def _opened(path: Path) -> IO[bytes]:
    """Open a file, be it a pipe that nobody writes to."""
    flag = getattr(os, "O_NONBLOCK", 0)
    try:
        return path.open("rb") if not flag else os.fdopen(os.open(path, os.O_RDONLY | flag), "rb")
    except ValueError:  # a null character
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL)) from None
