"""The paper, reproduced: its figures drawn and its claims checked by the package's public functions.

A figure is a function of a few lines in :mod:`udd.paper.figures`, a claim one in :mod:`udd.paper.claims`;
both enter themselves into the lists below. Where the paper measured, a film is made of a run of its own
model, and tracked.
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
