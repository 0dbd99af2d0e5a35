"""What of a curve the free parameters of the fit could do as well."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from udd.fitting import Fit

from .curves import Curve, score_groups
from .forcing import responses

Array = NDArray[np.float64]

_ABSORBED = 0.05  # a curve of which the free parameters leave no more is theirs


@dataclass(frozen=True)
class Absorbed:
    """What the free parameters of a fit do as well as a curve would.

    A constant that moves the wheels is the drive's speed, a torque proportional to Omega is friction: how
    much of these belongs to the curve cannot be known.

    Attributes
    ----------
    rows : ndarray (a, k)
        How much of each of a such curves there is in coefficients.
    vectors : ndarray (k, a)
        By how much the coefficients change, most likely, with each.
    """

    rows: Array
    vectors: Array

    def aligned(self, coefficients: Array, to: Array) -> Array:
        """The coefficients with as much of these curves as others have, to compare the two."""
        result: Array = coefficients + self.vectors @ (self.rows @ (to - coefficients))
        return result

    def left(self, covariance: Array) -> Array:
        """The covariance of a curve of which these are agreed upon."""
        result: Array = covariance - self.vectors @ self.rows @ covariance
        return result


def absorbed(curve: Curve, fit: Fit) -> Absorbed:
    """Which curves the fit's free parameters take up, all but a twentieth of their effect."""
    (known,) = score_groups(responses(fit), [(curve.slot, curve.coordinates)], [curve.splines], known=True)
    k = len(known.information)
    full = known.information + 1e-9 * np.trace(known.information) / k * np.eye(k)
    share, vectors = eigh(curve.score.information, full)
    rows = vectors[:, share < _ABSORBED].T @ full
    across = curve.covariance @ rows.T
    return Absorbed(rows, np.linalg.solve(rows @ across, across.T).T if len(rows) else across)


def distinct(curve: Curve, fit: Fit) -> Curve:
    """The curve with the errors that remain where what the free parameters absorb is agreed upon."""
    return replace(curve, covariance=absorbed(curve, fit).left(curve.covariance))
