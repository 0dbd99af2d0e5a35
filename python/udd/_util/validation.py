"""Checks of what users hand over: each says in one sentence what is wrong."""

from __future__ import annotations

import math
from typing import Any, SupportsFloat, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.memory import require_memory
from udd.errors import ModelError

_LARGEST = 2**62  # as a number of the core, with room for sums


def number(name: str, value: object, *, least: float | None = None, above: float | None = None) -> float:
    """Check a finite float, at least `least` or above `above`.

    Raises
    ------
    ModelError
        Naming the parameter.
    """
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)):
            raise TypeError
        result = float(cast("SupportsFloat", value))
    except (TypeError, ValueError):
        raise ModelError(f"{name} must be a number, not {value!r}") from None
    except OverflowError:
        raise ModelError(f"{name} is too large a number") from None
    if not math.isfinite(result):
        raise ModelError(f"{name} must be finite, not {result}")
    if least is not None and result < least:
        raise ModelError(f"{name} must not be below {least:g}, not {result:g}")
    if above is not None and result <= above:
        raise ModelError(f"{name} must be above {above:g}, not {result:g}")
    return result


def whole(name: str, value: object, least: int) -> int:
    """Check a whole number of at least `least`.

    Raises
    ------
    ModelError
        Naming it.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ModelError(f"{name} must be a whole number of at least {least}, not {value!r}")
    if value > _LARGEST:
        raise ModelError(f"{name} must be a whole number of at most 2^62")
    return int(value)


def array(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a C-contiguous, aligned float64 array of finite numbers; copy what is not.

    Raises
    ------
    ModelError
        Naming the argument.
    """
    try:
        given: NDArray[Any] = np.asarray(value)
        if given.dtype.kind not in "iuf":
            raise TypeError
        if given.dtype != np.float64 or not given.flags.c_contiguous:
            require_memory(f"the numbers of {name}", given.size)
        result = np.require(given, np.float64, ["C", "A"])
    except (TypeError, ValueError):
        raise ModelError(f"{name} must be numbers") from None
    if not np.isfinite(result).all():
        raise ModelError(f"{name} must be finite")
    return result
