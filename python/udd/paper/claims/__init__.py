"""Claims in the paper's order; importing this module registers them all."""

from . import equations, slow, falls, drives, lorenz, rotation, discussion  # noqa: F401, I001
