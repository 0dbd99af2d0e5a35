"""The claims, in the paper's order; importing this enters them all into the list."""

from . import equations, slow, falls, drives, lorenz, rotation, discussion  # noqa: F401, I001
