"""Floquet multipliers by the periodic Schur decomposition, and how far they can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from udd import _core

from .flow_map import Floats

if TYPE_CHECKING:
    from .shooting_curve import PeriodicOrbitCurve

__all__ = ["Multipliers", "multipliers_at"]

_ROUGH = 1e-12  # Relative error of a piece's derivatives: runs to the tolerance 1e-13, and rounding.
_KNOWN = 0.1  # Relative error beyond which the sign of a multiplier is open.
_WEAK = 0.5  # Size below which this sign does not matter.


@dataclass(frozen=True)
class Multipliers:
    """Multipliers across the flow of the map that closes an orbit.

    Attributes
    ----------
    log : ndarray, shape (r - 1,), of a forced model (r,)
        The logarithms of their absolute values, largest first.
    phases : ndarray of complex, shape (r - 1,)
        The values divided by these.
    error : ndarray, shape (r - 1,)
        Bounds of their relative errors, to first order.
    """

    log: Floats
    phases: NDArray[np.complex128]
    error: Floats

    @property
    def values(self) -> NDArray[np.complex128]:
        """The multipliers; what is too large for its square to be a float is 1e150 long."""
        with np.errstate(over="ignore", under="ignore"):
            values: NDArray[np.complex128] = self.phases * np.minimum(np.exp(self.log), 1e150)
        return values

    @property
    def decided(self) -> bool:
        """True if the side of the unit circle is certain for each multiplier."""
        with np.errstate(over="ignore", invalid="ignore"):
            # A direction that dies out, as where a contact sticks, is zero to the last bit.
            weak = np.isneginf(self.log) | (np.exp(self.log) * (1.0 + self.error) < _WEAK)
        return bool(((self.error < _KNOWN) | weak).all())


def multipliers_at(curve: PeriodicOrbitCurve, u: Floats) -> Multipliers:
    """Return the multipliers of the orbit with these unknowns.

    The derivatives of the pieces, restricted to the planes across the flow at their ends, are never
    multiplied with one another: weak multipliers are accurate next to strong ones.
    """
    factors = curve.factors_across(u)
    multipliers = _core.floquet(factors)
    if multipliers is None:
        lost = np.full(factors.shape[1], np.nan)
        return Multipliers(lost, lost.astype(complex), np.full(factors.shape[1], np.inf))
    return Multipliers(
        multipliers["log"], multipliers["re"] + 1j * multipliers["im"], _ROUGH * multipliers["condition"]
    )
