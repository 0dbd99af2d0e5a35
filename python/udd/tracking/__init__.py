"""The tracker: a film of the marked disk goes in, its motion in metres and radians comes out."""

from __future__ import annotations

from udd.tracking.calibration.config_writer import write_config
from udd.tracking.manual.click import click
from udd.tracking.metric.pixels_to_metres import Pixels, pixels
from udd.video.reader import Film, TrackError
from udd.video.webcam import Recording, record

from .options import TrackOptions
from .overlay import overlay
from .page import page
from .pictures import pictures_at, pictures_between
from .pipeline import track, track_disk
from .tracked_frame import TrackedFrame
from .tracking_result import Tracking

__all__ = [
    "Film",
    "Pixels",
    "Recording",
    "TrackError",
    "TrackOptions",
    "TrackedFrame",
    "Tracking",
    "click",
    "overlay",
    "page",
    "pictures_at",
    "pictures_between",
    "pixels",
    "record",
    "track",
    "track_disk",
    "write_config",
]
