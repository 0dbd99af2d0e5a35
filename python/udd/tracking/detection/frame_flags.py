"""Flags of frames without a position: one word and the reason."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from udd.video.reader import Picture, Plane

COPIED = 10  # codes by which a copy may differ
UNCHANGED = 12  # pixels that may differ by more; an edge that moves by one pixel changes more
BLANK = 6.0  # brightness contrast of a black frame
DAMAGED = "damaged: the frame does not decode whole"
BLACK = "black: the frame shows nothing"
OMITTED = "omitted: left out by the user"
REPEATED = "dup: the frame repeats the one before"
VAGUE = "vague: too blurred or hidden to be placed"
GONE = "gone: the disk has left the wheels"


def unusable(picture: Picture) -> str:
    """Return the flag of a picture that shows nothing; empty if it may show something."""
    return unread(picture) or (BLACK if float(picture.y[::8, ::8].std()) < BLANK else "")


def unread(picture: Picture) -> str:
    """Return the flag of a picture that is not used at all; empty if it is used."""
    if picture.left_out:
        return OMITTED
    return DAMAGED if picture.damaged else ""


def is_copy(y: Plane, last: Plane, places: Iterable[complex], reach: int) -> bool:
    """Return True if no edge moved within `reach` pixels of some places; a codec does not copy exactly."""
    changed, size = 0, 0
    for place in places:
        r, c = int(place.imag), int(place.real)
        part = slice(max(0, r - reach), max(0, r + reach)), slice(max(0, c - reach), max(0, c + reach))
        changed += int(np.count_nonzero(np.abs(y[part].astype(np.int16) - last[part]) > COPIED))
        size += y[part].size
    return size > 0 and changed < UNCHANGED


def lost(why: str) -> str:
    """Return the flag of a frame in which the object was not found."""
    return f"lost: {why}"


def is_lost(flag: str) -> bool:
    """Return True if a frame may be tried again."""
    return flag.startswith("lost")
