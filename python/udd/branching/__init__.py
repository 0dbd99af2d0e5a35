"""Attractors over a parameter (bifurcation diagrams) and over initial states (basins)."""

from __future__ import annotations

from .diagram import bifurcation
from .grids import basins

__all__ = ["basins", "bifurcation"]
