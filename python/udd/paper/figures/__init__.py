"""The figures, in the paper's order; importing this enters them all into the list."""

from . import measured, friction, computed, phase, rotation, clock, heights  # noqa: F401, I001
