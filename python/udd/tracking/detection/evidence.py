"""Brightness of a film's pictures, and patches by colour, for a film in which no disk is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from udd.tracking.options import TrackOptions
from udd.video.reader import Picture

from .colour_blobs import COLOURS, coloured
from .layout_matching import coloured as in_layout

LOOKED = 24  # pictures
DARK = 70.0  # of 255: a film of which 95 % is darker takes more light


def shown(pictures: Sequence[Picture], options: TrackOptions) -> str:
    """Return what the pictures show of the marks' colours, and what to do, as the end of a message."""
    some = [p for p in pictures if not p.damaged][:: max(1, -(-len(pictures) // LOOKED))]
    bright = float(np.median([np.quantile(p.y[::4, ::4], 0.95) for p in some])) if some else 0.0
    if bright < DARK:
        return f"the film is dark (95 % of it below {bright:.0f} of 255): take more light"
    counts = np.zeros(len(options.layout.places), dtype=int)
    for picture in some:
        inside = options.inside(picture)
        blobs = coloured(inside) if options.layout.standard else in_layout(inside, options.layout)
        counts += [len(blob.centre) > 0 for blob in blobs]
    where = "" if options.region is None else " in the region"
    if not counts.any():
        return f"no frame has a patch in any of these colours{where}: give the disk's own marks (layout)"
    names = COLOURS if options.layout.standard else [f"mark {k + 1}" for k in range(len(counts))]
    seen = ", ".join(f"{name} {n}" for name, n in zip(names, counts, strict=True))
    what = f"patches{where} by colour, in {len(some)} frames: {seen}"
    if counts.min() < len(some) / 2:
        return f"{what}; show all of the marks, or give the disk's own (layout)"
    return f"{what}, but never as on a disk; give the disk's own marks (layout), or where it is (region)"
