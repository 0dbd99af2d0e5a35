"""Suggestions for words that are not known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def meant(word: str, choices: Iterable[str]) -> str:
    """Return "; did you mean X?" with the nearest choice, or nothing if none is near.

    >>> meant("--w", ["--g", "--W"]), meant("quit", ["fit"]), meant("fut", ["fit"])
    ('; did you mean --W?', '', '; did you mean fit?')
    """
    every = list(choices)
    same = [choice for choice in every if choice.casefold() == word.casefold()]
    matches = same or difflib.get_close_matches(word, every, 1, 0.6)
    return f"; did you mean {matches[0]}?" if matches else ""
