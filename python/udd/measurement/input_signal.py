"""A measured input as a function of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.arguments import checked_arguments
from udd._util.drawable import Drawable
from udd.errors import MeasurementError

__all__ = ["Hold", "InputSignal", "input_signals"]

Hold = Literal["zero", "linear", "cubic"]


@dataclass(frozen=True, eq=False)
class InputSignal(Drawable):
    """Measured input (exogenous signal): samples, and the law between them.

    Parameters
    ----------
    t : array_like, shape (n,)
        Times of the samples [s], strictly increasing; two at least.
    values : array_like, shape (n,)
        The samples, in units of the user's.
    hold : {"linear", "zero", "cubic"}, default "linear"
        Between samples: straight lines; the last sample (zero-order hold, the output of a digital
        controller); or the natural cubic spline.

    Raises
    ------
    MeasurementError
        Times that do not increase, samples that are not finite, lengths that differ, an unknown hold.

    See Also
    --------
    udd.simulate : runs a model with inputs.
    udd.input_bias : the effect of its noise on a fit.
    udd.plot.input_signal : draw the signal.

    Examples
    --------
    >>> import udd
    >>> udd.InputSignal([0.0, 0.5, 1.0], [0.0, 1.0, 0.0])([0.25, 0.5])
    array([0.5, 1. ])
    """

    t: NDArray[np.float64]
    values: NDArray[np.float64]
    hold: Hold = "linear"

    @checked_arguments(error=MeasurementError)
    def __init__(self, t: ArrayLike, values: ArrayLike, hold: Hold = "linear") -> None:
        if hold not in get_args(Hold):
            raise MeasurementError(f"hold must be one of {', '.join(get_args(Hold))}, not {hold!r}")
        columns = []
        for name, given in (("times", t), ("samples", values)):
            column = np.array(_numbers(f"an input's {name}", given))
            if column.ndim != 1 or not np.isfinite(column).all():
                raise MeasurementError(f"an input's {name} must be a list of finite numbers")
            column.setflags(write=False)
            columns.append(column)
        times, samples = columns
        if len(times) != len(samples) or len(times) < 2:
            raise MeasurementError(
                f"an input needs as many samples as times, two at least, not {len(samples)} and {len(times)}"
            )
        if (np.diff(times) <= 0).any():
            row = int(np.argmax(np.diff(times) <= 0)) + 1
            raise MeasurementError(
                f"an input's times must increase; sample {row} does not come after the last"
            )
        for name, value in (("t", times), ("values", samples), ("hold", hold)):
            object.__setattr__(self, name, value)

    @property
    def span(self) -> tuple[float, float]:
        """The times between which it is known [s]."""
        return float(self.t[0]), float(self.t[-1])

    @checked_arguments(error=MeasurementError)
    def shifted(self, by: float) -> InputSignal:
        """Return the same signal, delayed.

        Parameters
        ----------
        by : float
            Delay [s].

        Returns
        -------
        InputSignal
            With the same samples at later times.
        """
        return InputSignal(self.t + by, self.values, self.hold)

    def rate(self) -> InputSignal:
        """Compute the derivative: steps for straight lines, a spline for a cubic spline.

        Returns
        -------
        InputSignal
            In the signal's unit per second.

        Raises
        ------
        MeasurementError
            A zero-order hold, which jumps.

        Examples
        --------
        >>> import udd
        >>> udd.InputSignal([0.0, 1.0, 2.0], [0.0, 3.0, 3.0]).rate()([0.5, 1.5])
        array([3., 0.])
        """
        if self.hold == "zero":
            raise MeasurementError(
                "an input with hold='zero' jumps and has no rate; expected hold='linear' or 'cubic'"
            )
        slopes = self.pieces[:, 1]
        last = np.diff(self.t[-2:])[0] ** np.arange(4)
        end = float(np.arange(1, 4) * self.pieces[-1, 1:] @ last[:3])
        return InputSignal(self.t, np.append(slopes, end), "zero" if self.hold == "linear" else "cubic")

    def lacks(self, start: float, end: float, slack: float, whose: str) -> str:
        """Describe the part of a span of time that the signal does not cover.

        Parameters
        ----------
        start, end : float
            The span [s].
        slack : float
            Time that may be missing at both ends [s].
        whose : str
            Name of the span in the sentence.

        Returns
        -------
        str
            Empty if the signal covers the span.
        """
        first, last = self.span
        if first - slack <= start and end <= last + slack:
            return ""
        return f"is known from t = {first:g} to {last:g}, but the {whose} goes from {start:g} to {end:g}"

    def coefficients(self) -> NDArray[np.float64]:
        """Return the polynomial between each two samples, over the time since the first of them.

        Returns
        -------
        ndarray, shape (n - 1, 4)
            Coefficients, lowest power first.
        """
        return self.pieces

    @cached_property
    def pieces(self) -> NDArray[np.float64]:
        """Return and keep :meth:`coefficients`; each run and each step of a fit uses them."""
        pieces = np.zeros((len(self.t) - 1, 4))
        pieces[:, 0] = self.values[:-1]
        if self.hold == "linear":
            pieces[:, 1] = np.diff(self.values) / np.diff(self.t)
        elif self.hold == "cubic":
            from scipy.interpolate import CubicSpline

            pieces = CubicSpline(self.t, self.values, bc_type="natural").c[::-1].T.copy()
        pieces.setflags(write=False)
        return pieces

    @checked_arguments(error=MeasurementError)
    def __call__(self, t: ArrayLike) -> NDArray[np.float64]:
        """Evaluate the signal at times of any shape; beyond its ends it keeps the value at the end."""
        at = np.clip(_numbers("t", t), *self.span)
        piece = np.clip(np.searchsorted(self.t, at, side="right") - 1, 0, len(self.t) - 2)
        since = at - self.t[piece]
        powers = since[..., None] ** np.arange(4)
        values = (self.pieces[piece] * powers).sum(axis=-1)
        # A held sample lasts until the next one; the last one is met at the end.
        return np.asarray(np.where(at >= self.t[-1], self.values[-1], values))

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        first, last = self.span
        return f"<InputSignal: {len(self)} samples, t = {first:.6g} to {last:.6g} s, {self.hold} hold>"


def named_signal(name: str, t: ArrayLike, values: ArrayLike, hold: Any = "linear") -> InputSignal:
    """Make a signal from its samples; an error names the signal.

    Raises
    ------
    MeasurementError
    """
    try:
        return InputSignal(t, values, hold)
    except MeasurementError as error:
        raise MeasurementError(f"the input {name}: {error}") from None


def input_signals(
    given: Mapping[str, InputSignal | ArrayLike] | None, t: NDArray[np.float64]
) -> dict[str, InputSignal]:
    """Inputs by name, each a signal, or samples at the times `t`.

    Raises
    ------
    MeasurementError
        What is none of these, naming the input.
    """
    return {
        str(name): value if isinstance(value, InputSignal) else named_signal(name, t, value)
        for name, value in (given or {}).items()
    }


def _numbers(what: str, given: ArrayLike) -> NDArray[np.float64]:
    """Convert an argument to numbers, of any shape."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise MeasurementError(f"{what} must be numbers") from None
