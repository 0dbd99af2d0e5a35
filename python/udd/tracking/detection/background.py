"""The still background of a film: its points, followed from picture to picture, show the camera's motion."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd.errors import outside
from udd.tracking.correction import Correction
from udd.video.reader import Film, Picture, Plane
from udd.video.resampling import resampled

from .camera_motion import CameraMotion, about_median
from .fine_places import FinePlaces
from .frame_flags import unusable
from .survey import Survey

Array = NDArray[np.float64]
POINTS = 300  # points of a picture that are tried
CONTRAST = (0.005, 0.001)  # least contrast of a point, share of the strongest; the second if the first fails
LARGE = 2e6  # pixels: larger pictures, as of 4K, are reduced by a whole factor ...
SMALL = 1.3e5  # pixels: and once more until points are searched for
LEARNED = 40  # pictures that show which of them belong to the background
EXISTS = 0.3  # share of the pictures in which strong points show the background; below it there is none
OFTEN = 0.35  # share of these pictures in which a point of the background moves with the others
FEWEST = 10  # points that must have the common motion
SHARE = 0.25  # share of the points that can be followed that must have it
BACK = 0.7  # pixels by which a point may miss its start when it is followed back
OFF = 0.7  # pixels by which a point may miss the common motion
PATCH = 5  # side of the square about a point whose light is compared [pixels]
WINDOW = 15  # side of the square by which a point is followed [pixels]
KNOWN, ALL = 0.8, 0.98  # share of the pictures whose view must be known; above the second no others are tried
UNSURE = 0.06  # pixels: a view with a larger standard error is not used
UNLIKE = 0.03  # relative difference of light that is evened out before points are followed
ZOOMS = tuple(1.12**k for k in (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6))  # that are tried if all else fails
MOST_FAILED = 5  # pictures in a row after which other zooms are tried in every ...
SELDOM = 20  # ... so many pictures only
NOWHERE = (complex(np.nan, np.nan), complex(np.nan, np.nan), np.nan, (np.nan, np.nan, np.nan))
LEAST = 0.01  # least error of a point's place [pixels]
Row = tuple[complex, complex, float, tuple[float, float, float]]  # of one frame: as the fields of the motion


def measured_camera_motion(film: Film, look_over: Survey) -> CameraMotion | None:
    """Return the motion of the camera; None if it was at rest, or if the background does not show it.

    Pictures of the survey decide which points belong to the background, and whether they move at all; only
    then are they followed through the film.
    """
    whole = [p for p in look_over.pictures if not unusable(p)]
    if not whole:
        return None
    best, share, most = None, KNOWN, 0.0
    for contrast, part in product(CONTRAST, (0.0, 0.5, 1.0)):  # after a zoom another picture may show more
        if contrast < CONTRAST[0] and most < EXISTS:
            break  # weak points of the disk itself may move together
        background = Background(whole[round(part * (len(whole) - 1))].y, film.light, contrast)
        seen = background.follow(whole[::2]) if background.learned(whole) else None
        if seen is None:
            continue
        shown = float(seen.is_measured.mean())
        most = max(most, shown)
        if shown >= share:
            best, share = (background, seen), shown
        if share > ALL:
            break
    if best is None or (best[1].steady and best[1].as_bright):
        return None
    moved = best[0].follow(film.pictures()).rested()
    still = moved.steady and moved.as_bright
    return None if still or moved.is_measured.mean() < KNOWN else moved


class _Seen(NamedTuple):
    """A frame's row, the points that show it, and the misfit of each [pixels]."""

    row: Row
    used: NDArray[np.intp]
    rest: NDArray[np.complex128]


def steadied(film: Film, look_over: Survey) -> tuple[Survey, CameraMotion | None]:
    """Undo a camera's motion, zoom and steps of exposure, in the survey and in the film from here on."""
    camera = measured_camera_motion(film, look_over)
    if camera is None:
        return look_over, None
    correct = camera.correction(Correction(full_range=film.full_range))
    film.correct = correct
    warnings.warn(f"{film.path}: {camera.text}", stacklevel=outside())
    return replace(look_over, bursts=[[correct(p) for p in burst] for burst in look_over.bursts]), camera


class Background:
    """Points about the disk that stand still, followed from one picture into others."""

    def __init__(self, first: Plane, light: Array, contrast: float = CONTRAST[0]) -> None:
        import cv2

        self.light = light.astype(np.float32)
        self.reduction = max(1, int((first.size / LARGE) ** 0.5))
        large = _reduced(first, self.reduction)
        self.large_middle = _middle(large)
        self.coarseness = max(1, int((large.size / SMALL) ** 0.5))
        self.fine = FinePlaces(large) if self.coarseness > 1 else None
        self.first = _reduced(large, self.coarseness)
        self.middle = _middle(self.first)
        height, width = self.first.shape
        spacing = max(5, round((height * width / 8000) ** 0.5))
        corners = cv2.goodFeaturesToTrack(self.first, POINTS, contrast, spacing, blockSize=5)
        self._use(np.asarray([] if corners is None else corners, np.float32).reshape(-1, 2))
        self.view = (1 + 0j, 0j)  # the last that is known
        self.failed = 0  # pictures in a row whose view was not found

    def _use(self, points: NDArray[np.float32], spread: Array | None = None) -> None:
        self.points, self.bright = points, self._light(self.first, points)
        self.spread = np.ones(len(points)) if spread is None else spread  # of each one's place [pixels]

    def learned(self, pictures: Sequence[Picture]) -> bool:
        """Keep the points that move with most others in most pictures; return False if too few do."""
        if len(self.points) < FEWEST:
            return False
        votes, squares, count = np.zeros(len(self.points)), np.zeros(len(self.points)), 0
        for picture in pictures[:: max(1, len(pictures) // LEARNED)]:
            view = self._seen(picture.y)
            if view is not None:
                count += 1
                votes[view.used] += 1
                squares[view.used] += np.abs(view.rest) ** 2
        keep = votes > OFTEN * max(count, 1)
        self._use(self.points[keep], np.sqrt(squares[keep] / votes[keep] + LEAST**2))
        self.view = (1 + 0j, 0j)
        return len(self.points) >= FEWEST

    def follow(self, pictures: Iterable[Picture]) -> CameraMotion:
        """Return the view of each picture."""
        rows: list[Row] = []
        for picture in pictures:
            view = None if unusable(picture) else self._seen(picture.y)
            rows.append(NOWHERE if view is None else view.row)
        factor, shift, gain, sigma = (np.array(x) for x in zip(*rows, strict=True))
        n, corner = self.reduction, (0.5 + 0.5j) * (self.reduction - 1)  # the middle of a reduced pixel
        shift = n * shift + corner * (1 - factor)
        place = n * self.large_middle + corner
        return about_median(CameraMotion(factor, shift, gain, sigma * [n, n, 1], place, n))

    def _seen(self, y: Plane) -> _Seen | None:
        """Return the view of a picture with the points that show it; None if too few agree."""
        large = _reduced(y, self.reduction)
        y = _reduced(large, self.coarseness)
        brighter = float(np.median(self.first[::4, ::4])) / max(float(np.median(y[::4, ::4])), 1.0)
        brighter = brighter if abs(brighter - 1) > UNLIKE else 1.0
        for factor, shift, steadied in self._guesses(_as_light(y, brighter)):
            points = self._follow(steadied)
            if points is None:
                continue
            used, there = points
            body = self.points[used].astype(float) @ [1, 1j]
            step, away, rest, sigma = _similar(
                body, there.astype(float) @ [1, 1j], self.spread[used], self.middle
            )
            if sigma[0] > UNSURE:
                continue
            self.view, self.failed = (factor * step, factor * away + shift), 0
            seen = self._light(y, self.points[used], *self.view)
            gain = float(np.median(seen / np.maximum(self.bright[used], 1.0)))
            if self.fine is not None:
                return self._finer(self.fine, large, used, body, gain, brighter)
            return _Seen((*self.view, gain, sigma), used, rest)
        self.failed += 1
        return None

    def _finer(
        self,
        fine: FinePlaces,
        large: Plane,
        used: NDArray[np.intp],
        body: NDArray[np.complex128],
        gain: float,
        brighter: float,
    ) -> _Seen | None:
        """Return the present view as the larger picture shows it; None if too few points agree."""
        n, (factor, shift) = self.coarseness, self.view
        corner = (0.5 + 0.5j) * (n - 1)  # the middle of a reduced pixel
        rows, first, there = fine.compare(
            large, n * body + corner, factor, n * shift + corner * (1 - factor), brighter
        )
        if len(rows) < FEWEST:
            return None
        factor, shift, rest, sigma = _similar(first, there, self.spread[used[rows]], self.large_middle)
        return _Seen((factor, shift, gain, sigma), used[rows], rest)

    def _guesses(self, y: Plane) -> Iterator[tuple[complex, complex, Plane]]:
        """Yield views to start from, and the picture as the first frame's camera would show it then."""
        factor, shift = self.view
        yield factor, shift, _seen_from(y, factor, shift)
        if abs(factor - 1) + abs(shift) > 0.5:
            yield 1 + 0j, 0j, y
        if self.failed < MOST_FAILED or self.failed % SELDOM == 0:
            for zoom in ZOOMS:
                guess = factor * zoom, shift + factor * self.middle * (1 - zoom)
                yield *guess, _seen_from(y, *guess)

    def _follow(self, y: Plane) -> tuple[NDArray[np.intp], NDArray[np.float32]] | None:
        """Return the points that have the common motion since the first picture, and their places in `y`."""
        import cv2

        how = {"winSize": (WINDOW, WINDOW), "maxLevel": 3}
        there, ok, _ = cv2.calcOpticalFlowPyrLK(self.first, y, self.points, None, **how)  # type: ignore[call-overload]
        back, ok_back, _ = cv2.calcOpticalFlowPyrLK(y, self.first, there, None, **how)  # type: ignore[call-overload]
        good = (ok.ravel() > 0) & (ok_back.ravel() > 0)
        good &= np.abs(back - self.points).max(axis=1) < BACK
        if good.sum() < FEWEST:
            return None
        rows = np.flatnonzero(good)
        _, agree = cv2.estimateAffinePartial2D(
            self.points[rows], there[rows], method=cv2.RANSAC, ransacReprojThreshold=OFF, maxIters=500
        )
        if agree is None or agree.sum() < max(FEWEST, SHARE * good.sum()):
            return None
        used = rows[agree.ravel() > 0]
        return used, there[used]

    def _light(self, y: Plane, points: NDArray[np.float32], factor: complex = 1, shift: complex = 0) -> Array:
        """Return the mean light about points of the first picture, in a picture with another view."""
        import cv2

        if not len(points):
            return np.empty(0)
        near = np.arange(PATCH) - PATCH // 2
        patch = (near[:, None] * 1j + near).ravel()
        there = factor * (np.round(points).astype(float) @ [1, 1j])[:, None] + factor * patch + shift
        at = np.ascontiguousarray(there.real, np.float32), np.ascontiguousarray(there.imag, np.float32)
        seen = cv2.remap(y, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(self.light[seen].mean(axis=1), float)


def _middle(y: Plane) -> complex:
    height, width = y.shape
    return complex(width - 1, height - 1) / 2


def _reduced(y: Plane, factor: int) -> Plane:
    """Return the picture with each square of pixels averaged."""
    import cv2

    if factor == 1:
        return y
    height, width = (size // factor for size in y.shape)
    part = y[: height * factor, : width * factor]
    return np.asarray(cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _as_light(y: Plane, ratio: float) -> Plane:
    """Return the picture with its codes multiplied."""
    import cv2

    return y if ratio == 1 else np.asarray(cv2.convertScaleAbs(y, alpha=ratio), np.uint8)


def _seen_from(y: Plane, factor: complex, shift: complex) -> Plane:
    """Return the picture as the camera of the first frame would have taken it."""
    if factor == 1 and shift == 0:
        return y
    view = np.array([[factor.real, -factor.imag, shift.real], [factor.imag, factor.real, shift.imag]])
    return resampled(y, view)


def _similar(
    body: NDArray[np.complex128], seen: NDArray[np.complex128], spread: Array, middle: complex
) -> tuple[complex, complex, NDArray[np.complex128], tuple[float, float, float]]:
    """Fit a turn, a factor and a shift by least squares, with smaller weights for points that are far off.

    Returns them (the turn and the factor as a complex factor), the residual of each point, and the standard
    errors of u and v at `middle` and of the turn.
    """
    weight = spread**-2.0
    for _ in range(4):
        centre = (weight @ body) / weight.sum()
        arm = body - centre
        square = float(weight @ np.abs(arm) ** 2)
        factor = complex((weight * arm.conj()) @ (seen - (weight @ seen) / weight.sum())) / square
        shift = complex((weight @ seen) / weight.sum() - factor * centre)
        rest = seen - factor * body - shift
        off = np.abs(rest) / spread
        usual = float(np.median(off)) / 1.18  # of two normal coordinates
        weight = spread**-2.0 / (1 + (off / (3 * max(usual, 1e-9))) ** 2)
    turn = usual / np.sqrt(square)
    place = float(np.hypot(usual / np.sqrt(weight.sum()), turn * abs(middle - centre)))
    return factor, shift, rest, (place, place, float(turn))
