"""The tracker: a film of the marked disk goes in, its motion in metres and radians comes out."""

from __future__ import annotations

from .camera import Recording, record
from .click import click
from .decode import Film, TrackError
from .glimpse import Glimpse
from .overlay import overlay
from .page import page
from .result import Pixels, pixels
from .run import Tracking, pictures_at, pictures_between, track, track_in_detail
from .toml import write_config

__all__ = [
    "Film",
    "Glimpse",
    "Pixels",
    "Recording",
    "TrackError",
    "Tracking",
    "click",
    "overlay",
    "page",
    "pictures_at",
    "pictures_between",
    "pixels",
    "record",
    "track",
    "track_in_detail",
    "write_config",
]
