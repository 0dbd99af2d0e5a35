"""The command line `udd`. Exit codes: 0 fine, 1 bad input, 2 wrong usage, 130 on Ctrl-C."""

from __future__ import annotations

from .entry import main

__all__ = ["main"]
