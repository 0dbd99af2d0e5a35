"""Figures in the paper's order; importing this module registers them all."""

from . import geometry, measured, falls, friction, computed, phase, rotation  # noqa: F401, I001
from . import clock, steady, heights, overturning  # noqa: F401
