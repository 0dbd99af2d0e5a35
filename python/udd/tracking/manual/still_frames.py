"""Frames of a film to click on: those in which least moves and most of the marks is seen."""

from __future__ import annotations

import numpy as np

from udd.tracking.detection.colour_blobs import LEAST_CHROMA
from udd.tracking.detection.frame_flags import unusable
from udd.tracking.detection.survey import Survey
from udd.video.reader import Picture

OPEN = 0.05  # of the range from fewest to most coloured samples: how much may be hidden
MOST = 8  # frames to choose from


def still_frames(look_over: Survey) -> list[Picture]:
    """Return frames of the survey, the calmest first, no two of one burst.

    A frame moves by the larger of its differences from both neighbours, so that a frame that a codec repeated
    is not calm. Hidden marks, or marks that blur makes pale, reduce the coloured samples; a coloured
    background is the same in all frames. If all frames are unusable, all are returned.
    """
    calm: list[tuple[float, int, Picture]] = []
    for burst in look_over.bursts:
        here = []
        for k, picture in enumerate(burst):
            beside = [burst[j].y[::2, ::2].astype(np.int16) for j in (k - 1, k + 1) if 0 <= j < len(burst)]
            if unusable(picture) or not beside:
                continue
            moved = max(float(np.abs(picture.y[::2, ::2] - other).mean()) for other in beside)
            u, v = picture.u.astype(np.float32) - 128, picture.v.astype(np.float32) - 128
            here.append((moved, int(np.count_nonzero(np.hypot(u, v) > LEAST_CHROMA)), picture))
        if len(here) > 2:
            here = here[1:-1]  # those with a neighbour on each side
        if here:
            calm.append(min(here, key=lambda item: item[0]))
    if not calm:
        return look_over.pictures[:MOST]
    most, least = max(n for _, n, _ in calm), min(n for _, n, _ in calm)
    seen = [item for item in calm if item[1] >= most - OPEN * (most - least)]
    seen.sort(key=lambda item: item[0])
    shown = {picture.index for _, _, picture in seen}
    rest = sorted((item for item in calm if item[2].index not in shown), key=lambda item: -item[1])
    return [picture for _, _, picture in (seen + rest)[:MOST]]
