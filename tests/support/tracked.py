"""Films that several tests look at, tracked once per run."""

from __future__ import annotations

import udd
from disk_cache import cached_on_disk
from udd.tracking import track_disk as _track_disk

track = cached_on_disk(udd.track)
track_disk = cached_on_disk(_track_disk)
