"""Outcomes of runs, in one list for all."""

from __future__ import annotations

OUTCOMES = ("finished", "ejected", "time ran out", "failed", "interrupted", "escaped", "chattering")
"""The meanings of an array of outcomes, by its values."""

FINISHED = OUTCOMES.index("finished")
EJECTED = OUTCOMES.index("ejected")
FAILED = OUTCOMES.index("failed")
INTERRUPTED = OUTCOMES.index("interrupted")
