"""Quality of each frame's pose: marks, completeness, residual, blur, method, and remarks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .tracks import Tracks

LATE = 1.5  # usual intervals: after a longer one frames are missing
AROUND = 5  # intervals on each side that say what is usual
ENOUGH = 3  # marks: two leave one coordinate to judge by


def quality(tracks: Tracks, given: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Return the columns of `Measurement.quality`; `given`: frames with a pose in the table."""
    used = np.isfinite(tracks.chi2)
    left = tracks.residuals
    with np.errstate(invalid="ignore", divide="ignore"):
        square = np.where(used, (left**2).sum(axis=2), 0.0).sum(axis=1) / (2 * used.sum(axis=1))
    tracked = used.any(axis=1)
    method = np.where(given, np.array(tracks.method, dtype=np.str_), "none")
    return {
        "marks": used.sum(axis=1),
        "complete": np.round(tracks.complete.mean(axis=1), 4),
        "residual_px": np.where(tracked, np.round(np.sqrt(square), 5), np.nan),
        "blur_px": np.where(tracked, np.round(tracks.streak, 3), np.nan),
        "method": np.where(method == "", "none", method),
    }


def remarks(
    t: NDArray[np.float64],
    flags: Sequence[str],
    table: dict[str, NDArray[Any]],
    twice: bool,
    since: Sequence[tuple[int, str]] = (),
) -> list[str]:
    """Return the flags, with `gap` and `degraded` for frames with a pose; `twice`: of two passes.

    `since`: numbers of frames from which on all are in doubt, and why.
    """
    missing = missing_before(t)
    enough = min(ENOUGH, int(table["marks"].max(initial=0)))
    said = []
    for flag, lost, marks, method in zip(flags, missing, table["marks"], table["method"], strict=True):
        if flag:
            said.append(flag)
        elif lost:
            said.append(f"gap: {lost} {'frame is' if lost == 1 else 'frames are'} missing before")
        elif marks < enough:
            said.append(f"degraded: {marks} marks only")
        elif twice and method == "fast":
            said.append("degraded: the second pass did not hold it")
        else:
            said.append("")
    for first, why in since:
        said[first:] = [f"degraded: {why}" if flag == "" else flag for flag in said[first:]]
    return said


def missing_before(t: NDArray[np.float64]) -> list[int]:
    """Count the missing frames before each, by the intervals around it: a camera may slow down for good."""
    steps = np.diff(t)
    out = [0]
    for k, step in enumerate(steps):
        usual = float(np.median(steps[max(0, k - AROUND) : k + AROUND + 1]))
        out.append(round(step / usual) - 1 if step > LATE * usual else 0)
    return out
