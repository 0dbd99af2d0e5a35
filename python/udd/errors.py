"""Errors that a user can act on: one clear sentence naming what is wrong."""

from __future__ import annotations


class UddError(ValueError):
    """Base class of what `udd` raises for bad input."""
