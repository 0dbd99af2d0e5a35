"""Attractors over a parameter (bifurcation diagrams) and over initial states (basins)."""

from __future__ import annotations

from .basin_grid import basins
from .bifurcation_diagram import bifurcation

__all__ = ["basins", "bifurcation"]
