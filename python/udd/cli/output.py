"""Results of commands, and lines about work that takes long."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from udd._util.progress import status

_FIRST = 0.45  # s of silence after a start of 0.2 to 0.5 s: faster work needs no line
_PAUSE = 5.0  # s between two lines of the same work


@dataclass(frozen=True)
class CommandResult:
    """The result of a command; `code` is its exit code."""

    text: str
    data: Mapping[str, Any]
    code: int = 0


def is_terminal() -> bool:
    """Return True if somebody sees a progress bar."""
    return sys.stderr.isatty()


@contextmanager
def speaking(text: str) -> Iterator[None]:
    """Write lines on a pipe or into a file while a command works, `text` first; a terminal shows bars."""
    global _lines
    if is_terminal() or not _is_stream():
        yield
        return
    with _Lines(text) as _lines:
        try:
            yield
        finally:
            _lines = None


def _is_stream() -> bool:
    """Return True if standard error is a pipe or a file, and no object of a program that called `main`."""
    try:
        sys.stderr.fileno()
    except (AttributeError, OSError, ValueError):
        return False
    return True


def shown_progress() -> bool | Callable[[str], object]:
    """Return what a long function takes as `progress`: True in a terminal, else what writes lines."""
    return is_terminal() if _lines is None else _lines


@contextmanager
def status_line(text: str = "") -> Iterator[Callable[[str], None]]:
    """Show what is being done, on one line of a terminal or in lines on a pipe."""
    with status(shown_progress()) as tell:
        if text:
            tell(text)
        yield tell


class _Lines:
    """Lines on stderr for a pipe or a log; it is called with what is being done.

    Work that ends within `_FIRST` seconds says nothing. After that each new thing has a line at once, and a
    long one another line every `_PAUSE` seconds.
    """

    def __init__(self, text: str) -> None:
        self._text, self._printed = text, ""
        self._begin, self._talks = time.monotonic(), False
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __call__(self, text: str) -> None:
        with self._lock:
            self._text = text
            if self._talks and _topic(text) != _topic(self._printed):
                self._print()

    def __enter__(self) -> _Lines:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        pause = _FIRST
        while not self._over.wait(pause):
            with self._lock:
                self._talks = True
                if self._text:
                    self._print()
            pause = _PAUSE

    def _print(self) -> None:
        self._printed = self._text
        seconds = time.monotonic() - self._begin
        print(f"udd: {self._text} [{seconds:.0f} s]", file=sys.stderr, flush=True)


def _topic(text: str) -> str:
    """Return a text without its numbers, to count similar texts."""
    return "".join(letter for letter in text if not (letter.isdigit() or letter in ".,"))


_lines: _Lines | None = None
