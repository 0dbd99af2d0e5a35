"""Bounds of the errors of what is solved for: by less accurate runs, and by roundoff."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from udd.errors import IntegrationError

from .conservative_families import in_a_family
from .flow_map import Floats
from .pseudo_arclength import CorrectorFailed, natural_constraint, newton_corrector
from .shooting_curve import PeriodicOrbitCurve

COARSE = 100.0  # factor by which the runs that measure the error are less accurate


def rounding_of(value: Any) -> Any:
    """How far rounding may move a value, or several."""
    return 8.0 * float(np.finfo(float).eps) * np.abs(value)


def period_error_of(curve: PeriodicOrbitCurve, u: Floats) -> float:
    """A bound of the error of a cycle's period: how far it moves when runs are less accurate.

    A member of a family has no bound unless its period or energy is fixed: less accurate runs find another.
    """
    if in_a_family(curve, u):
        return float("nan")
    known, coarse, row = curve.period(u), replace(curve, loose=COARSE), natural_constraint(u)
    try:
        moved = coarse.period(newton_corrector(coarse, u, row))
    except (CorrectorFailed, IntegrationError):
        return float("nan")
    return float(abs(moved - known) + rounding_of(known))
