"""How long a search may take."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from udd._util.parallel import parallel_map
from udd.errors import FitError

From = TypeVar("From")
To = TypeVar("To")


class TimeUpError(Exception):
    """The time that a search was given is over; no fault of a model, which an attempt would survive."""


class Clock:
    """The time that a search has, and what it is doing.

    Parameters
    ----------
    budget : float or None
        s from now; None for as long as it takes.
    tell : callable
        Told in a few words what is being done.

    Raises
    ------
    FitError
        The budget is no positive number.
    """

    def __init__(self, budget: float | None, tell: Callable[[str], object]) -> None:
        if budget is not None and not (isinstance(budget, (int, float, np.integer)) and budget > 0):
            raise FitError(f"the budget must be a positive number of seconds, not {budget!r}")
        self.budget = math.inf if budget is None else float(budget)
        self.end, self._tell, self.doing = time.monotonic() + self.budget, tell, ""

    def tell(self, text: str) -> None:
        """Begin something, unless the time is up."""
        self.doing = text
        self.check()
        self._tell(text)

    def trying(self, titles: Sequence[str]) -> None:
        """Begin to fit proposals, if there are any, unless the time is up."""
        if titles:
            self.tell(f"trying {titles[0]}" + (f" and {len(titles) - 1} more" if titles[1:] else ""))

    def finish(self, text: str) -> None:
        """Begin something that is done in any case."""
        self._tell(text)

    def check(self) -> None:
        """Raise TimeUpError once the time is up."""
        if time.monotonic() > self.end:
            raise TimeUpError(self.doing)

    def watched(self, work: Callable[[From], To]) -> Callable[[From], To]:
        """The same work, which does not begin once the time is up."""

        def checked(piece: From) -> To:
            self.check()
            return work(piece)

        return checked

    def each(self, work: Callable[[From], To], pieces: Iterable[From]) -> list[To]:
        """Independent pieces of work side by side, as long as there is time."""
        return parallel_map(self.watched(work), pieces)
