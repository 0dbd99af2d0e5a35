"""Reproduction of the paper: its figures drawn and its claims checked by the package's public functions.

A figure is a short function in :mod:`udd.paper.figures`, a claim one in :mod:`udd.paper.claims`; both
register themselves in the lists below. For the paper's measurements, a run of its model is rendered as a film
and tracked.
"""

from __future__ import annotations

from . import claims as _claims  # noqa: F401
from . import figures as _figures  # noqa: F401
from .make import Checked, Drawn, Reproduction, reproduce
from .registry import CLAIMS, FIGURES, Claim, Figure, Verdict

__all__ = [
    "CLAIMS",
    "FIGURES",
    "Checked",
    "Claim",
    "Drawn",
    "Figure",
    "Reproduction",
    "Verdict",
    "reproduce",
]
