"""Errors that a user can act on: one clear sentence naming what is wrong."""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable
from functools import cached_property
from typing import Any

_WORD, _ALL = 200, 500  # characters of a word or a part of the input, and of a message
# Parts of the input in a message. The first pattern may contain the others.
_REPEATED = [
    re.compile(rf"{before}{{{_WORD},}}")
    for before in ("(?<=, not ).", r"(?:^|(?<= ))[\[{].", r"(?<= ')[^']", r'(?<= ")[^"]', r"\S")
]


class UddError(ValueError):
    """Base class of all errors that `udd` raises for bad input.

    Parameters
    ----------
    message : str
        One sentence. Long parts of the input are cut.
    """

    def __init__(self, message: str = "", *more: object) -> None:
        text = message
        for repeated in _REPEATED:
            text = repeated.sub(lambda part: f"{part[0][: _WORD - 3]}...", text)
        super().__init__(text if len(text) <= _ALL else f"{text[: _ALL - 3]}...", *more)


class ModelError(UddError):
    """Error of a model, an effect, a state or an option of a run that cannot be used."""


class IntegrationError(UddError):
    """Error of a run that blows up, or leaves the domain of the model."""


class MeasurementError(UddError):
    """Error of a measurement, or of its file, that cannot be used."""


class FitError(UddError):
    """Error of a measurement that a model cannot be fitted to."""


class TrackError(UddError):
    """Error of a film that cannot be read, or shows no disk that can be tracked."""


class ConvergenceWarning(UserWarning):
    """Warning that a result's error bar does not meet the tolerance."""


class ToleranceWarning(UserWarning):
    """Warning that a component of the state below `atol` grows again, with an error that matters."""


class StiffnessWarning(UserWarning):
    """Warning that stability limits the steps of a run: a method for stiff models is faster."""


class IncompleteWarning(UserWarning):
    """Warning that a result lacks the parts that were not finished.

    Parameters
    ----------
    message : str
        What is missing, and why.
    interrupted : bool
        Whether the user stopped it.
    """

    def __init__(self, message: str, interrupted: bool = False) -> None:
        super().__init__(message)
        self.interrupted = interrupted


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with the part of the result that was computed before it.

    Parameters
    ----------
    message : str
        How much is missing.
    build : callable
        Makes the partial result, when it is asked for.
    """

    def __init__(self, message: str, build: Callable[[], Any]) -> None:
        super().__init__(message)
        self._build = build

    @cached_property
    def partial(self) -> Any:
        """The finished part of the function's result: NaN and the outcome "interrupted" elsewhere."""
        return self._build()


def interrupted(build: Callable[[], Any], message: str, partial: bool) -> None:
    """Raise :class:`Interrupted`, or warn whoever asked for a partial result."""
    if not partial:
        raise Interrupted(message, build) from None
    warnings.warn(IncompleteWarning(message, interrupted=True), stacklevel=outside())


def outside() -> int:
    """Return the `stacklevel` at which a warning of the caller names the line that called the package."""
    package, level = __name__.partition(".")[0], 1
    frame = inspect.currentframe()
    frame = frame.f_back if frame is not None else None
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    return level
