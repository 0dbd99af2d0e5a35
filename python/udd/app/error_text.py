"""What is said to a person who is told that something does not work."""

from __future__ import annotations


def sentence(error: object) -> str:
    """What is wrong, with a capital and a full stop."""
    text = " ".join(str(error).split())
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")
