"""Find the terms missing from a fitted model and confirm them on held-out data."""

from __future__ import annotations

from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.held_out_errors import Errors

from .discover import discover
from .experiment_design import NextExperiment
from .results import AddedEffect, Alternative, Discovery, RejectedEffect
from .term_elimination import Pruned, prune

__all__ = [
    "AddedEffect",
    "Alternative",
    "Discovery",
    "Errors",
    "NextExperiment",
    "Pruned",
    "RejectedEffect",
    "Scored",
    "discover",
    "prune",
]
