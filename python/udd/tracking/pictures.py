"""Pictures of a film as the tracker corrected them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from udd.measurement import Measurement
from udd.tracking.correction import correction_of
from udd.video.frame_conversion import Conversion
from udd.video.reader import Film, Picture, TrackError
from udd.video.rgb_frames import rgb


def pictures_at(
    video: str | os.PathLike[str], frames: Sequence[int], tracked: Measurement | None = None
) -> list[NDArray[np.uint8]]:
    """Return frames of a film by their number, as RGB arrays.

    With `tracked` they are corrected as the tracker corrected them: steadied and turned upright.

    Parameters
    ----------
    video : path
        The film.
    frames : sequence of int
        Numbers of the frames, counted from 0.
    tracked : Measurement, optional
        Result of :func:`udd.track` for this film.

    Returns
    -------
    list of ndarray of uint8, shape (height, width, 3)
        In the order of `frames`.

    Raises
    ------
    TrackError
        The film cannot be read, or has no frame with one of these numbers.

    See Also
    --------
    udd.tracking.pictures_between : frames by their times.
    udd.plot.overlay : draw the fitted disk into a frame.

    Examples
    --------
    >>> from udd import tracking
    >>> first, later = tracking.pictures_at("run.mp4", [0, 100])  # doctest: +SKIP
    """
    wanted = {int(i) for i in frames}
    images: dict[int, NDArray[np.uint8]] = {}
    film = _as_tracked(video, tracked)
    for picture in film.pictures():
        if picture.index in wanted:
            images[picture.index] = rgb(picture, film.full_range)
            if len(images) == len(wanted):
                break
    lost = wanted - set(images)
    if lost:
        raise TrackError(f"{video}: there is no frame {min(lost)}")
    return [images[int(i)] for i in frames]


def _as_tracked(video: str | os.PathLike[str], tracked: Measurement | None) -> Film:
    """Open a film with the corrections of a measurement."""
    # Pictures have no times: a folder of them takes its rate from the measurement.
    rate = (1.0 if tracked is None else float(tracked.meta["fps"])) if Path(video).is_dir() else None
    film = Film(video, fps=rate)
    if tracked is not None:
        if "conversion" in tracked.meta:
            film.conversion = Conversion(*tracked.meta["conversion"])
        film.correct = correction_of(tracked.meta, tracked.quality, film.full_range)
    return film


def pictures_between(
    video: str | os.PathLike[str], t: NDArray[np.float64], tracked: Measurement | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames nearest to increasing times, as RGB arrays.

    Frames long before them are not decoded, unless `tracked` has a correction. If the film ends before a
    time, its last frame is nearest.

    Parameters
    ----------
    video : path
        The film.
    t : ndarray, shape (n,)
        Increasing times [s].
    tracked : Measurement, optional
        Result of :func:`udd.track`; frames are corrected as the tracker corrected them.

    Yields
    ------
    ndarray of uint8, shape (height, width, 3)
        One frame for each time.

    Raises
    ------
    TrackError
        The film cannot be read.

    See Also
    --------
    udd.tracking.pictures_at : frames by their numbers.

    Examples
    --------
    >>> from udd import tracking
    >>> frames = tracking.pictures_between("run.mp4", np.array([0.5, 1.0]))  # doctest: +SKIP
    """
    film, wanted = _as_tracked(video, tracked), iter(t.tolist())
    want = next(wanted, None)
    before: Picture | None = None
    # A correction has one entry per frame, and frames are counted from where decoding begins.
    for picture in film.pictures(float(t[0]) if film.correct is None else 0.0):
        while want is not None and before is not None and picture.t > want:
            nearest = before if want - before.t < picture.t - want else picture
            yield rgb(nearest, film.full_range)
            want = next(wanted, None)
        if want is None:
            return
        before = picture
    while want is not None and before is not None:
        yield rgb(before, film.full_range)
        want = next(wanted, None)
