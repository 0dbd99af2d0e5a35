"""Sweeps over parameters and initial states, chunk by chunk, on anything that runs work."""

from __future__ import annotations

from .run_sweep import sweep
from .spec import SweepSpec

__all__ = ["SweepSpec", "sweep"]
