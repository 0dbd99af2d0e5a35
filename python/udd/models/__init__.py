"""Models: the equations of the paper, of a pendulum, and of the user."""

from __future__ import annotations

from .base import Model, require_model
from .compiled import beyond_the_edge
from .disk import Disk
from .dle import DLE
from .driven import driven_disk, moved_pendulum
from .mechanisms import mechanism, pendulum_chain
from .pendulum import Pendulum
from .registry import profile_of

__all__ = [
    "DLE",
    "Disk",
    "Model",
    "Pendulum",
    "beyond_the_edge",
    "driven_disk",
    "mechanism",
    "moved_pendulum",
    "pendulum_chain",
    "profile_of",
    "require_model",
]
