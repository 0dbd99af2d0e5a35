"""Time limit of a search."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from typing import TypeVar

import numpy as np

from udd._util.parallel import parallel_map
from udd._util.time_limit import limited
from udd.errors import FitError

From = TypeVar("From")
To = TypeVar("To")


class TimeUpError(Exception):
    """Signal that the time of a search is over; no fault of a model, so an attempt must not catch it."""


class Clock:
    """Time limit of a search, s from now, and its current activity.

    `tell` is called with a short description of each stage.
    """

    def __init__(self, budget: float | None, tell: Callable[[str], object]) -> None:
        if budget is not None and not (isinstance(budget, (int, float, np.integer)) and budget > 0):
            raise FitError(f"the budget must be a positive number of seconds, not {budget!r}")
        self.budget = math.inf if budget is None else float(budget)
        self.end, self._tell, self.doing = time.monotonic() + self.budget, tell, ""

    def tell(self, text: str) -> None:
        """Report the next stage, unless the time is up."""
        self.doing = text
        self.check()
        self._tell(text)

    def trying(self, titles: Sequence[str]) -> None:
        """Report the fits of proposals, if any, unless the time is up."""
        if titles:
            self.tell(f"trying {titles[0]}" + (f" and {len(titles) - 1} more" if titles[1:] else ""))

    def finish(self, text: str) -> None:
        """Report a stage that runs in any case."""
        self._tell(text)

    def check(self) -> None:
        """Raise TimeUpError once the time is up."""
        if time.monotonic() > self.end:
            raise TimeUpError(self.doing)

    def limited(self) -> AbstractContextManager[None]:
        """Limit the work inside: no fit starts once the time is up."""
        return limited(self.check)

    def each(self, work: Callable[[From], To], pieces: Iterable[From]) -> list[To]:
        """Run independent pieces of work in parallel while there is time."""

        def watched(piece: From) -> To:
            self.check()
            return work(piece)

        return parallel_map(watched, pieces)
