"""A process that reads what others wrote, and the pipes to and from it."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import weakref
from typing import IO, Any

PIPE = 1 << 20  # bytes that the pipe from it should hold


class ChildProcess:
    """A Python script in a process of its own, which ends with this object.

    Parameters
    ----------
    script : str
        File to run; it imports nothing from the folder that it lies in.
    *arguments : str
        Its arguments.
    environment : dict, optional
        Variables that it gets with those of this process.
    patience : float
        Seconds for which it may be silent.
    """

    def __init__(
        self,
        script: str,
        *arguments: str,
        environment: dict[str, str] | None = None,
        patience: float = 60.0,
    ) -> None:
        self.patience = patience
        self.process = subprocess.Popen(
            [sys.executable, "-P", script, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env=None if environment is None else {**os.environ, **environment},
        )
        self.end = weakref.finalize(self, _end, self.process)
        assert self.process.stdin is not None and self.process.stdout is not None
        self.to: IO[bytes] = self.process.stdin
        self.pipe: IO[bytes] = self.process.stdout
        _widen(self.pipe)

    def send(self, data: bytes) -> None:
        """Write all bytes to its standard input.

        Raises
        ------
        OSError
            It has ended.
        """
        rest = memoryview(data)
        while rest:
            rest = rest[self.to.write(rest) :]

    def line(self, longest: int = 1 << 24) -> bytes:
        """Read the next line that the process writes; empty at the end."""
        return self.pipe.readline(longest) if self._ready() else b""

    def fill(self, room: Any) -> bool:
        """Read exactly as many bytes as there is room for; False if it ends before."""
        view, done = memoryview(room), 0
        if not view.nbytes:
            return True
        view = view.cast("B")
        while done < len(view):
            if not self._ready():
                return False
            got = self.pipe.readinto(view[done:])  # type: ignore[attr-defined]
            if not got:
                return False
            done += got
        return True

    def _ready(self) -> bool:
        """Return True if the process answers before patience ends (always on systems that cannot wait)."""
        try:
            return bool(select.select([self.pipe], [], [], self.patience)[0])
        except (OSError, ValueError):  # Windows selects among sockets only
            return True


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    process.wait()


def _widen(pipe: IO[bytes]) -> None:
    try:
        import fcntl

        fcntl.fcntl(pipe.fileno(), fcntl.F_SETPIPE_SZ, PIPE)
    except (ImportError, AttributeError, OSError):
        pass  # not this system; it is only slower
