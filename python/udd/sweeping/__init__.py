"""Sweeps over parameters and initial states, chunk by chunk, on anything that runs work."""

from __future__ import annotations

from .spec import SweepSpec
from .sweeps import sweep

__all__ = ["SweepSpec", "sweep"]
