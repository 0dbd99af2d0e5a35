"""A film with what the tracker found drawn upon it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.tracking.correction import correction_of
from udd.tracking.metric.pixels_to_metres import Pixels, pixels
from udd.video.reader import Film
from udd.video.rgb_frames import rgb

FITTED, CONTACT, SAID = (0, 220, 220), (255, 0, 200), (255, 230, 0)
FINE = 4  # bits of sub-pixel coordinates
SLOWEST, LIKELY = 1.0, 25.0  # frames/s: what containers take; where the film does not say


def overlay(video: str | os.PathLike[str], measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write the film again with the rim, the marks' places, the contact and the flags drawn into it.

    Parameters
    ----------
    video : path
        The film that was tracked.
    measurement : Measurement
        Result of `udd.track`, or read back from its file.
    path : path
        Film to write, ``.mp4`` or ``.mov``.

    Raises
    ------
    UddError
        The place cannot be written to, or the measurement does not come from a film.

    See Also
    --------
    udd.track : makes the measurement.
    udd.plot.overlay : draw a single frame.

    Examples
    --------
    >>> import udd
    >>> m = udd.track("run.mp4")  # doctest: +SKIP
    >>> udd.tracking.overlay("run.mp4", m, "seen.mp4")  # doctest: +SKIP
    """
    from udd.video.writer import checked_path, require_video, write_film

    require_video()
    if "px_per_m" not in measurement.meta:
        raise ValueError(
            "the measurement does not come from a film, so it cannot be drawn on one; use one from udd.track"
        )
    film = Film(video)
    film.correct = correction_of(measurement.meta, measurement.quality, film.full_range)
    target = checked_path(path)
    frames = _drawn(film, measurement, pixels(measurement))
    first = next(frames)
    height, width = first.shape[:2]
    rate = film.fps if np.isfinite(film.fps) and film.fps >= SLOWEST else LIKELY

    def all_frames() -> Iterator[NDArray[np.uint8]]:
        yield first
        yield from frames

    write_film(target, all_frames(), (width, height), Fraction(rate).limit_denominator(1001), 20.0)


def _drawn(film: Film, measurement: Measurement, where: Pixels) -> Iterator[NDArray[np.uint8]]:

    for picture in film.pictures():
        if picture.index >= len(measurement):
            return
        image = np.ascontiguousarray(rgb(picture, film.full_range))
        image = np.ascontiguousarray(image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2])
        draw(image, where, picture.index, str(measurement.flag[picture.index]))
        yield image


def draw(image: NDArray[np.uint8], where: Pixels, k: int, flag: str) -> None:
    """Draw one row of a measurement into an RGB picture."""
    import cv2

    def points(at: NDArray[np.float64]) -> NDArray[np.int32]:
        return np.asarray(np.round(at * 2**FINE), dtype=np.int32)

    u, v = points(where.pivot)
    cv2.drawMarker(image, (int(u) >> FINE, int(v) >> FINE), CONTACT, cv2.MARKER_CROSS, 14, 1)
    if np.isfinite(where.angle[k]):
        cv2.polylines(image, [points(where.rim[k])], True, FITTED, 1, cv2.LINE_AA, FINE)
        for mark, colour in zip(where.marks[k], where.colours, strict=True):
            x, y = points(mark)
            for radius, paint in ((6, (255, 255, 255)), (4, colour)):
                cv2.circle(image, (int(x), int(y)), radius << FINE, paint, 2, cv2.LINE_AA, FINE)
    said = f"{k}  {flag}" if flag else f"{k}"
    cv2.putText(image, said, (9, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(image, said, (9, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.5, SAID, 1, cv2.LINE_AA)
