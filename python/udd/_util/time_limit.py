"""Time limit of long work, checked between its steps in all of its threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_check: ContextVar[Callable[[], None] | None] = ContextVar("time_limit", default=None)


@contextmanager
def limited(check: Callable[[], None]) -> Iterator[None]:
    """Call `check` between the steps of the work inside; it raises once the time is up."""
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)


def check_time() -> None:
    """Raise if the time of the work that this step belongs to is up."""
    if (check := _check.get()) is not None:
        check()
