"""Film a simulated run: what a camera in front of the device would see."""

from __future__ import annotations

from udd.film.defects import Defects
from udd.film.rendering import Film, render

__all__ = ["Defects", "Film", "render"]
