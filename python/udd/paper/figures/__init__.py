"""The figures, in the paper's order; importing this enters them all into the list."""

from . import geometry, measured, falls, friction, computed, phase, rotation  # noqa: F401, I001
from . import clock, steady, heights, overturning  # noqa: F401
