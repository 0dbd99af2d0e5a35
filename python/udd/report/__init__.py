"""The page that a person reads: what was found, shown in pictures, in one file."""

from __future__ import annotations

from .page import report_of, summary_of, write
from .terminal import as_text

__all__ = ["as_text", "report_of", "summary_of", "write"]
