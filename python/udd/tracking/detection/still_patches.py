"""Patches of colour that stand still in a film, and those that do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .colour_blobs import Blobs

STILL = 0.7  # share of the pictures in which a patch that stands still is in one place
STANDS = 1.5  # pixels by which it may seem to move


def split(patches: Sequence[list[Blobs]], still: bool) -> list[list[Blobs]]:
    """Return, of each picture's patches of each colour, those that stand still, or those that do not."""
    out = [list(p) for p in patches]
    for k in range(len(patches[0]) if patches else 0):
        everywhere = [p[k].centre for p in patches]
        for row, p in zip(out, patches, strict=True):
            here = p[k].centre
            count = np.zeros(len(here))
            for other in everywhere:
                if len(other) and len(here):
                    count += np.abs(here[:, None] - other[None, :]).min(axis=1) < STANDS
            keep = (count >= STILL * len(patches)) == still
            row[k] = Blobs(here[keep], p[k].area[keep])
    return out
