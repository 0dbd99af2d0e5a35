"""Films that several tests look at, tracked once per run."""

from __future__ import annotations

import udd
from kept import kept
from udd.tracking import track_disk as _track_disk

track = kept(udd.track)
track_disk = kept(_track_disk)
