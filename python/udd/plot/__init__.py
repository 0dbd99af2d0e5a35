"""Pictures of what the other functions return: a result goes in, the Axes come back.

Every function takes ``ax=None``; without Axes it makes a new figure. Nothing is computed here that the
results do not already hold, and no global matplotlib setting is changed.
"""

from __future__ import annotations

from .attractors import basins, bifurcation
from .branches import branches, diagram
from .crossings import poincare, return_map
from .curves import curve
from .evidence import errors, evidence
from .fits import misfit, residuals
from .forecast_fan import forecast
from .frame_overlay import overlay
from .friction import friction
from .geometry import geometry
from .motion import orbit, phase_space, time_series
from .residual_map import residual_map
from .whiteness import whiteness

__all__ = [
    "basins",
    "bifurcation",
    "branches",
    "curve",
    "diagram",
    "errors",
    "evidence",
    "forecast",
    "friction",
    "geometry",
    "misfit",
    "orbit",
    "overlay",
    "phase_space",
    "poincare",
    "residual_map",
    "residuals",
    "return_map",
    "time_series",
    "whiteness",
]
