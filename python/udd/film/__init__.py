"""Film a simulated run: what a camera in front of the device would see."""

from __future__ import annotations

from .defects import Defects
from .rendering import Film, render

__all__ = ["Defects", "Film", "render"]
