"""The tracker: a film of the marked disk goes in, its motion in metres and radians comes out."""

from __future__ import annotations

from .decode import Film, TrackError
from .glimpse import Glimpse
from .result import Pixels, pixels
from .run import Tracking, pictures_at, pictures_between, track, track_in_detail

__all__ = [
    "Film",
    "Glimpse",
    "Pixels",
    "TrackError",
    "Tracking",
    "pictures_at",
    "pictures_between",
    "pixels",
    "track",
    "track_in_detail",
]
