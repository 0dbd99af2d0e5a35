"""Confounding of a curve with the free parameters of the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from udd.discovery.scoring.forcing import responses
from udd.fitting import Fit

from .curve_scan import Curve, score_splines
from .penalized_curves import Confounding

_ABSORBED = 0.05  # share of a curve's information above which it is not confounded with the free parameters


def confounded_directions(curve: Curve, fit: Fit) -> Confounding:
    """Find the curves of which the fit's free parameters absorb all but a twentieth of the information."""
    (fixed_score,) = score_splines(
        responses(fit), [curve.slot], curve.coordinates, curve.splines, parameters_fixed=True
    )
    k = len(fixed_score.information)
    full = fixed_score.information + 1e-9 * np.trace(fixed_score.information) / k * np.eye(k)
    try:
        share, vectors = eigh(curve.score.information, full)
        rows = vectors[:, share < _ABSORBED].T @ full
        across = curve.covariance @ rows.T
        return Confounding(rows, np.linalg.solve(rows @ across, across.T).T if len(rows) else across)
    except (np.linalg.LinAlgError, ValueError):
        # If the record does not move in the curve's coordinate, nothing can be said about confounding.
        return Confounding(np.zeros((0, k)), np.zeros((k, 0)))


def identifiable_part(curve: Curve, fit: Fit) -> Curve:
    """Return the curve with the errors that remain if its confounded part is fixed."""
    confounded = confounded_directions(curve, fit)
    return replace(curve, covariance=confounded.left(curve.covariance), absorbed=confounded)
