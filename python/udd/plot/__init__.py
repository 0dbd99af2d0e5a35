"""Pictures of what the other functions return: a result goes in, the Axes come back.

Every function takes ``ax=None``; without Axes it makes a new figure. ``result.plot()`` calls the function for
the kind of the result (:func:`draw`). Nothing is computed here that the results do not already hold, and no
global matplotlib setting is changed.
"""

from __future__ import annotations

from .attractors import basins, bifurcation
from .branches import branches, diagram
from .by_kind import draw
from .crossings import poincare, return_map
from .curves import curve
from .evidence import errors, evidence
from .exponents import exponents, spectrum
from .fits import misfit, residuals
from .forecast_fan import forecast
from .frame_overlay import overlay
from .friction import friction
from .geometry import geometry
from .motion import orbit, phase_space, time_series
from .residual_map import residual_map
from .solutions import bias, cascade, cycle, eigenvalues, energy, ensemble, input_signal, lifetimes, locus
from .whiteness import whiteness

__all__ = [
    "basins",
    "bias",
    "bifurcation",
    "branches",
    "cascade",
    "curve",
    "cycle",
    "diagram",
    "draw",
    "eigenvalues",
    "energy",
    "ensemble",
    "errors",
    "evidence",
    "exponents",
    "forecast",
    "friction",
    "geometry",
    "input_signal",
    "lifetimes",
    "locus",
    "misfit",
    "orbit",
    "overlay",
    "phase_space",
    "poincare",
    "residual_map",
    "residuals",
    "return_map",
    "spectrum",
    "time_series",
    "whiteness",
]
