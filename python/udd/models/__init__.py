"""What is integrated: the equations of the paper, of a pendulum, and of the user."""

from __future__ import annotations

from .base import Model, require_model
from .builtin import DLE, Disk, Pendulum, beyond_the_edge

__all__ = ["DLE", "Disk", "Model", "Pendulum", "beyond_the_edge", "require_model"]
