"""Confounding: what of a curve the free parameters of the fit could do as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from udd.discovery.scoring.forcing import responses
from udd.fitting import Fit

from .curve_scan import Curve, score_splines
from .penalized_curves import Confounding

_ABSORBED = 0.05  # a curve of which the free parameters leave no more is theirs


def confounded_directions(curve: Curve, fit: Fit) -> Confounding:
    """Which curves the fit's free parameters take up, all but a twentieth of their effect."""
    (known,) = score_splines(responses(fit), [curve.slot], curve.coordinates, curve.splines, known=True)
    k = len(known.information)
    full = known.information + 1e-9 * np.trace(known.information) / k * np.eye(k)
    try:
        share, vectors = eigh(curve.score.information, full)
        rows = vectors[:, share < _ABSORBED].T @ full
        across = curve.covariance @ rows.T
        return Confounding(rows, np.linalg.solve(rows @ across, across.T).T if len(rows) else across)
    except (np.linalg.LinAlgError, ValueError):
        # Where the record moves the curve's places not at all, nothing can be said of who does what there.
        return Confounding(np.zeros((0, k)), np.zeros((k, 0)))


def identifiable_part(curve: Curve, fit: Fit) -> Curve:
    """The curve with the errors that remain where what the free parameters absorb is agreed upon."""
    theirs = confounded_directions(curve, fit)
    return replace(curve, covariance=theirs.left(curve.covariance), absorbed=theirs)
