"""What is said of a frame that holds no position: one word, and why."""

from __future__ import annotations

from udd.video.reader import Picture

BLANK = 6.0  # brightness contrast of a black frame
DAMAGED = "damaged: the frame does not decode whole"
BLACK = "black: the frame shows nothing"
REPEATED = "dup: the frame repeats the one before"
VAGUE = "vague: too blurred or hidden to be placed"
GONE = "gone: the disk has left the wheels"


def unusable(picture: Picture) -> str:
    """Why nothing can be seen in a picture; empty where something may be."""
    if picture.damaged:
        return DAMAGED
    return BLACK if float(picture.y[::8, ::8].std()) < BLANK else ""


def lost(why: str) -> str:
    """The flag of a frame in which what is followed was not found."""
    return f"lost: {why}"


def is_lost(flag: str) -> bool:
    """Whether a frame may be tried again."""
    return flag.startswith("lost")
