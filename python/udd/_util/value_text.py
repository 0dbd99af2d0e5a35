"""Numbers with their standard errors, as physicists write them: ``5.03(12)``."""

from __future__ import annotations

import math


def with_error(value: float, error: float | None, power: str = "e{}") -> str:
    """Write a value with the standard error of its last digits in brackets.

    Parameters
    ----------
    value : float
        The value.
    error : float or None
        Its standard error. If it is missing, not finite or not positive, the value has five digits.
    power : str
        Format of the power of ten that follows numbers from 1e5 on or below 1e-3.

    Examples
    --------
    >>> with_error(5.0312, 0.12), with_error(-5.03, 1.2), with_error(4.8e-4, 3e-6)
    ('5.03(12)', '-5.0(1.2)', '4.800(30)e-4')
    """
    if error is None or not math.isfinite(error) or error <= 0 or not math.isfinite(value):
        return f"{value:.5g}"
    size = math.floor(math.log10(max(abs(value), error)))
    ending = ""
    if size >= 5 or size <= -4:
        value, error, ending = value / 10.0**size, error / 10.0**size, power.format(size)
    # Round the error to two digits first, for this may carry: 0.0996 becomes 0.10.
    error = float(f"{error:.1e}")
    digits = max(1 - math.floor(math.log10(error)), 0)
    within = f"{error:.{digits}f}" if error >= 1.0 else f"{error * 10**digits:.0f}"
    rounded = f"{round(value, digits) + 0.0:.{digits}f}"  # adding 0 makes -0 positive
    return f"{rounded}({within}){ending}"
