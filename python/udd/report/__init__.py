"""The page that a person reads: what was found, shown in pictures, in one file."""

from __future__ import annotations

from .page import report_of, write

__all__ = ["report_of", "write"]
