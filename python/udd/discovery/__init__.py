"""The loop's second half: which effect the model lacks, and the error before and after."""

from __future__ import annotations

from .discover import discover
from .heldout import Errors
from .hint import Hint
from .pruning import Pruned, prune
from .results import Alternative, Discovery, Found, Refused
from .scan import Scored

__all__ = [
    "Alternative",
    "Discovery",
    "Errors",
    "Found",
    "Hint",
    "Pruned",
    "Refused",
    "Scored",
    "discover",
    "prune",
]
