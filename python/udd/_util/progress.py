"""Display of progress: a bar, lines of text, or a function of the caller's."""

from __future__ import annotations

import functools
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

from udd.errors import ModelError

P = ParamSpec("P")
R = TypeVar("R")

Progress = bool | Callable[[str], object] | None
"""True: a bar at once. False: nothing. A function: it gets the state of the work in words. None: a bar in a
terminal or a notebook, if the work takes longer than `PATIENCE`."""

PATIENCE = 2.0  # s before a bar shows that nobody asked for
_PAUSE = 0.1  # s between two calls of a caller's function


def thread_count(threads: int | None) -> int:
    """Check a number of threads and return it; 0 means one per core."""
    if threads is None:
        return 0
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ModelError(f"threads must be a whole number from 1 on, not {threads!r}")
    return threads


class Count:
    """Work whose amount is known; this one shows nothing.

    Attributes
    ----------
    n, total : float
        How much is done, and how much there is.
    """

    def __init__(self, total: float, n: float = 0) -> None:
        self.total, self.n = total, n

    def update(self, more: float = 1) -> None:
        """Add to what is done."""
        self.n += more

    def reach(self, done: float) -> None:
        """Set what is done."""
        self.update(done - self.n)

    def since(self, before: int = 0) -> Callable[[int], None] | None:
        """Return what the core calls with the number of jobs done after `before`; None if nobody looks."""
        return None

    def say(self, text: str) -> None:
        """Say what is done besides."""

    def clear(self) -> None:
        """Make room for a line on the same terminal."""

    def finish(self) -> None:
        """Show the end."""


class _Shown(Count):
    """Work that somebody looks at."""

    def since(self, before: int = 0) -> Callable[[int], None]:
        return lambda done: self.reach(before + done)


class _InBar(_Shown):
    def __init__(self, bar: Any, total: float, n: float) -> None:
        super().__init__(total, n)
        self._bar = bar

    def update(self, more: float = 1) -> None:
        super().update(more)
        self._bar.update(more)

    def say(self, text: str) -> None:
        self._bar.set_postfix_str(text)

    def clear(self) -> None:
        self._bar.clear()


class _InWords(_Shown):
    """Calls a function with a sentence such as "film: 120 of 900 frames"."""

    def __init__(self, tell: Callable[[str], object], unit: str, title: str, total: float, n: float) -> None:
        super().__init__(total, n)
        self._tell, self._unit, self._title, self._next = tell, unit, title, 0.0
        self._said: float | None = None

    def update(self, more: float = 1) -> None:
        super().update(more)
        if time.monotonic() >= self._next:
            self.finish()

    def say(self, text: str) -> None:
        self._tell(text)

    def finish(self) -> None:
        if self._said == self.n:
            return
        self._said = self.n
        self._tell(f"{self._title}{': ' if self._title else ''}{self.n:.6g} of {self.total:.6g} {self._unit}")
        self._next = time.monotonic() + _PAUSE


@contextmanager
def progress_bar(
    total: float, unit: str, progress: Progress, *, title: str = "", initial: float = 0, leave: bool = False
) -> Iterator[Count]:
    """Count work of a known amount, and show it as `progress` says.

    Parameters
    ----------
    total, initial : float
        The whole work, and the part that is done before.
    unit : str
        Unit of the work, in the singular.
    progress : bool, callable or None
        See `Progress`.
    title : str
        Name of the work.
    leave : bool
        If True, the bar stays when the work is done.
    """
    _check(progress)
    if callable(progress):
        spoken = _InWords(progress, unit if unit in ("s", "%") else f"{unit}s", title, total, initial)
        yield spoken
        spoken.finish()
    elif progress or (progress is None and is_watched()):
        options: dict[str, Any] = {} if title == "" else {"desc": title}
        bar = _bar_class()(
            total=total,
            initial=initial,
            unit=f" {unit}",
            delay=0 if progress else PATIENCE,
            dynamic_ncols=True,
            leave=leave,
            **options,
        )
        with bar:
            yield _InBar(bar, total, initial)
    else:
        yield Count(total, initial)


@contextmanager
def status(progress: Progress) -> Iterator[Callable[[str], None]]:
    """Give a function that says what is being done, and show that as `progress` says, with the time."""
    _check(progress)
    if callable(progress):
        call = progress

        def pass_on(text: str) -> None:
            call(text)

        yield pass_on
    elif progress or (progress is None and is_watched()):
        bar = _bar_class()(bar_format="{desc} [{elapsed}]", delay=0 if progress else PATIENCE, leave=False)
        with bar:

            def tell(text: str) -> None:
                bar.set_description_str(text, refresh=False)
                bar.update()  # unlike refresh() it waits for the delay

            yield tell
    else:
        yield lambda _text: None


def with_status(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function that says what it does: its `progress` becomes one to call, whatever was given."""

    @functools.wraps(function)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        given: Any = kwargs.pop("progress", None)
        with status(given) as tell:
            kwargs["progress"] = tell
            return function(*args, **kwargs)

    return wrapper


def _check(progress: object) -> None:
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise ModelError(f"progress must be True, False or a function of a text, not {progress!r:.60}")


def is_watched() -> bool:
    """Return True if somebody sees a bar: in a terminal or a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel") or bool(sys.stderr is not None and sys.stderr.isatty())


def _bar_class() -> Any:
    """Return the class of a notebook's bar, or of a terminal's."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a notebook without widgets has bars of text
        from tqdm.auto import tqdm
    return tqdm
