"""Motion, zoom and exposure of the camera, from the still background."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd.errors import outside
from udd.tracking.correction import Correction
from udd.video.reader import Film, Picture, Plane
from udd.video.resampling import resampled

from .frame_flags import unusable
from .survey import Survey

Array = NDArray[np.float64]
POINTS = 300  # of a picture that are tried
CONTRAST = (0.005, 0.001)  # of the strongest point that the others have; the weaker ones if the first fail
LARGE = 2e6  # pixels: larger pictures, as of 4K, are reduced by a whole factor
LEARNED = 40  # pictures that show which of them belong to the background
EXISTS = 0.3  # share of the pictures in which strong points show the background; without it there is none
OFTEN = 0.35  # share of these in which such a point goes with the others
FEWEST = 10  # points that must go the same way
SHARE = 0.25  # of all that can be followed that must
BACK = 0.7  # pixels by which a point may come back elsewhere when it is followed back
OFF = 0.7  # pixels by which a point may miss the common motion
SURE = 5.0  # standard errors by which a view may be off without being another
STEADY = 0.2  # pixels: a camera that moves less is at rest
AS_BRIGHT = 0.15  # relative change of light up to which all is taken as it is
PATCH = 5  # pixels about a point whose light is compared
WINDOW = 15  # pixels
KNOWN, ALL = (
    0.8,
    0.98,
)  # share of the pictures whose view is known; with less, the points are not the background's
PLACED, TURNED = 0.007, 0.05  # pixels, at the middle and at the corner: errors that change with the view
AROUND = 2  # frames on each side that show whether the camera rests
REST, RESTING = 20, 0.95  # frames that a rest lasts at least, and the share of them with the same view
UNSURE = 0.06  # pixels: a view known no better is none
UNLIKE = 0.03  # relative difference of light that is evened out before points are followed
ZOOMS = tuple(1.12**k for k in (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6))  # that are tried if all else fails
MOST_FAILED = 5  # pictures in a row after which other zooms are tried in every ...
SELDOM = 20  # ... so many pictures only


@dataclass(frozen=True)
class CameraMotion:
    """The view of each frame: a point z of the first picture lies at ``factor z + shift``; its light; errors.

    NaN where the background was not seen. `sigma` (n, 3): of u and v at `middle` [pixels], and of the turn.
    """

    factor: NDArray[np.complex128]
    shift: NDArray[np.complex128]
    gain: Array
    sigma: Array
    middle: complex

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Frames whose background was seen."""
        return np.asarray(np.isfinite(self.shift))

    @property
    def moved(self) -> NDArray[np.complex128]:
        """Return the distance of the picture's middle from its median place in each frame [pixels]."""
        away = self.factor * self.middle + self.shift - self.middle
        return np.asarray(away - complex(np.nanmedian(away.real), np.nanmedian(away.imag)))

    @property
    def turned(self) -> Array:
        """Return the motion of half the picture's diagonal by roll and zoom [pixels]."""
        away = self.factor / np.nanmedian(np.abs(self.factor))
        return np.asarray(np.abs(away - complex(np.nanmedian(away.real), np.nanmedian(away.imag))))

    @property
    def rms(self) -> float:
        """Motion of the picture's middle [pixels r.m.s.]."""
        return float(np.sqrt(np.nanmean(np.abs(self.moved) ** 2)))

    @property
    def steady(self) -> bool:
        """True if the camera was at rest."""
        if not self.is_measured.any():
            return True
        away = np.abs(self.moved) + self.turned * abs(self.middle)
        unsure = self.sigma[:, 0] + self.sigma[:, 2] * abs(self.middle)
        return bool(np.nanquantile(away - SURE * unsure, 0.99) < STEADY)

    @property
    def corner(self) -> NDArray[np.complex128]:
        """Place of the middle, and half the diagonal, in each frame (n, 2) [pixels]."""
        return np.column_stack([self.factor * self.middle + self.shift, self.factor * abs(self.middle)])

    @property
    def alike(self) -> Array:
        """Distance up to which two views are the same in each frame [pixels]."""
        return np.asarray(STEADY + SURE * (self.sigma[:, 0] + self.sigma[:, 2] * abs(self.middle)))

    @property
    def resting(self) -> NDArray[np.bool_]:
        """Frames whose view is that of the frames around: a camera that stands still between bumps."""
        place = self.corner
        out = np.ones(len(place), dtype=bool)
        for step in range(1, AROUND + 1):
            moved = np.abs(place[step:] - place[:-step]).sum(axis=1) > self.alike[step:]
            out[step:] &= ~moved
            out[:-step] &= ~moved
        return out

    def rested(self) -> CameraMotion:
        """Return the motion with the mean view of each part in which the camera rests."""
        place, sigma = self.corner, self.sigma.copy()
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.resting, [False]]).astype(int)))
        for first, end in edges.reshape(-1, 2):
            part = np.flatnonzero(self.is_measured[first:end]) + first
            if len(part) < REST:
                continue
            mean = place[part].mean(axis=0)
            same = np.abs(place - mean).sum(axis=1) < self.alike
            if same[part].mean() < RESTING:
                continue
            while first > 0 and same[first - 1]:
                first -= 1
            while end < len(place) and same[end]:
                end += 1
            # the points' errors hardly change from frame to frame, so that their mean is no better
            off = place[part] - mean
            turn = float(np.std(np.angle(self.factor[part])))
            sigma[first:end] = float(off[:, 0].real.std()), float(off[:, 0].imag.std()), turn
            place[first:end] = mean
        factor = place[:, 1] / abs(self.middle)
        return replace(self, factor=factor, shift=place[:, 0] - factor * self.middle, sigma=sigma)

    @property
    def as_bright(self) -> bool:
        """True if the light stays nearly the same."""
        return not self.is_measured.any() or bool(np.nanmax(np.abs(self.gain - 1)) < AS_BRIGHT)

    @property
    def text(self) -> str:
        """A sentence about what the camera did."""
        said = []
        if not self.steady:
            zoom = 100 * (np.nanmax(np.abs(self.factor)) / np.nanmin(np.abs(self.factor)) - 1)
            if zoom < 1 or self.rms > STEADY:
                said.append(f"the camera moved, by {self.rms:.2g} pixels r.m.s.")
            if zoom >= 1:
                said.append(f"the camera zoomed, by {zoom:.0f} %")
        if not self.as_bright:
            ratio = np.nanmax(self.gain) / np.nanmin(self.gain)
            said.append(f"the light of the pictures changes by a factor of {ratio:.2f}")
        lost = int((~self.is_measured).sum())
        frames = "one frame" if lost == 1 else f"{lost} frames"
        rest = f", but for {frames} without a background" if lost and not self.steady else ""
        return f"{' and '.join(said)}: what stands still about the disk shows it, and it is undone{rest}"

    @property
    def meta(self) -> dict[str, Any]:
        """Entries of the measurement's header."""
        if self.steady:
            return {}
        place = float(np.nanmedian(self.sigma[:, 0]))
        return {"camera_moved_px": round(self.rms, 4), "camera_sigma_px": round(place, 4)}

    def correction(self, before: Correction) -> Correction:
        """Return what steadies the pictures; a frame without a known view has that of the last known one."""
        last, lit = _last_known(self.is_measured), _last_known(np.isfinite(self.gain))
        none, full = np.empty(0, np.complex128), before.full_range
        factor, shift = (none, none) if self.steady else (self.factor[last], self.shift[last])
        gain = np.empty(0) if self.as_bright else self.gain[lit]
        return Correction(before.turns, before.mirrored, factor, shift, gain, full)

    def errors(self, at: NDArray[np.complex128]) -> list[Array]:
        """Standard errors (n, 3) of u, v and beta of a disk at these places, one array for each cause.

        The points are placed by the fraction of a pixel at which they lie, so that a view that changes has
        errors beyond their scatter.
        """
        arm = at - self.middle
        u, v, turn = np.nan_to_num(self.sigma[: len(at)]).T
        moving = ~self.resting[: len(at)]
        u, v = np.hypot(u, PLACED * moving), np.hypot(v, PLACED * moving)
        turn = np.hypot(turn, TURNED / abs(self.middle) * moving)
        return [
            np.column_stack([u, 0 * turn, 0 * turn]),
            np.column_stack([0 * turn, v, 0 * turn]),
            np.column_stack([-arm.imag * turn, arm.real * turn, turn]),
            np.column_stack([arm.real * turn, arm.imag * turn, 0 * turn]),
        ]


def _last_known(known: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each frame the last known one, or the first one before that."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
    return np.asarray(np.maximum(last, int(np.argmax(known))))


def _about_median(motion: CameraMotion) -> CameraMotion:
    """Return the motion against the camera's usual view, because the first roll is not special."""
    if not motion.is_measured.any():
        return motion
    factor, middle = motion.factor, motion.middle
    usual = complex(np.nanmedian(factor.real), np.nanmedian(factor.imag))
    there = factor * middle + motion.shift
    back = (middle - complex(np.nanmedian(there.real), np.nanmedian(there.imag))) / usual
    gain = motion.gain / np.nanmedian(motion.gain)
    return replace(
        motion,
        factor=factor / usual,
        shift=motion.shift + factor * (middle + back - middle / usual),
        gain=gain,
    )


NOWHERE = (complex(np.nan, np.nan), complex(np.nan, np.nan), np.nan, (np.nan, np.nan, np.nan))
LEAST = 0.01  # pixels: no point is followed better
Row = tuple[complex, complex, float, tuple[float, float, float]]  # of one frame: as the fields of the motion


def camera_motion(film: Film, look_over: Survey) -> CameraMotion | None:
    """Return how the camera moved; None if it was at rest, or if nothing about the disk shows it.

    Pictures of the survey decide which points belong to the background, and whether they move at all; only
    then are they followed through the film.
    """
    whole = [p for p in look_over.pictures if not unusable(p)]
    if not whole:
        return None
    best, share, most = None, KNOWN, 0.0
    for contrast, part in product(CONTRAST, (0.0, 0.5, 1.0)):  # after a zoom another picture may show more
        if contrast < CONTRAST[0] and most < EXISTS:
            break  # weak points of the disk itself may go the same way
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
    camera = camera_motion(film, look_over)
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
        self.first = self._reduced(first)
        height, width = self.first.shape
        self.middle = complex(width - 1, height - 1) / 2
        spacing = max(5, round((height * width / 8000) ** 0.5))
        corners = cv2.goodFeaturesToTrack(self.first, POINTS, contrast, spacing, blockSize=5)
        self._use(np.asarray([] if corners is None else corners, np.float32).reshape(-1, 2))
        self.view = (1 + 0j, 0j)  # the last that is known
        self.failed = 0  # pictures in a row whose view was not found

    def _use(self, points: NDArray[np.float32], spread: Array | None = None) -> None:
        self.points, self.bright = points, self._light(self.first, points)
        self.spread = np.ones(len(points)) if spread is None else spread  # of each one's place [pixels]

    def learned(self, pictures: Sequence[Picture]) -> bool:
        """Keep the points that go with most others in most pictures; False if there are too few."""
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
        place = n * self.middle + corner
        return _about_median(CameraMotion(factor, shift, gain, sigma * [n, n, 1], place))

    def _reduced(self, y: Plane) -> Plane:
        """Return the picture with each square of pixels averaged."""
        import cv2

        n = self.reduction
        if n == 1:
            return y
        height, width = (size // n for size in y.shape)
        part = y[: height * n, : width * n]
        return np.asarray(cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    def _seen(self, y: Plane) -> _Seen | None:
        """One picture's view, and the points that show it; None where too few agree."""
        y = self._reduced(y)
        for factor, shift, steadied in self._guesses(y):
            points = self._follow(steadied)
            if points is None:
                continue
            used, there = points
            factor_step, away, rest, sigma = _similar(
                self.points[used].astype(float) @ [1, 1j],
                there.astype(float) @ [1, 1j],
                self.spread[used],
                self.middle,
            )
            if sigma[0] > UNSURE:
                continue
            self.view, self.failed = (factor * factor_step, factor * away + shift), 0
            seen = self._light(y, self.points[used], *self.view)
            gain = float(np.median(seen / np.maximum(self.bright[used], 1.0)))
            return _Seen((*self.view, gain, sigma), used, rest)
        self.failed += 1
        return None

    def _guesses(self, y: Plane) -> Iterator[tuple[complex, complex, Plane]]:
        """Views to start from, and the picture as it would be from the first one's, about as bright."""
        y = _as_light(y, float(np.median(self.first[::4, ::4])) / max(float(np.median(y[::4, ::4])), 1.0))
        factor, shift = self.view
        yield factor, shift, _seen_from(y, factor, shift)
        if abs(factor - 1) + abs(shift) > 0.5:
            yield 1 + 0j, 0j, y
        if self.failed < MOST_FAILED or self.failed % SELDOM == 0:
            for zoom in ZOOMS:
                guess = factor * zoom, shift + factor * self.middle * (1 - zoom)
                yield *guess, _seen_from(y, *guess)

    def _follow(self, y: Plane) -> tuple[NDArray[np.intp], NDArray[np.float32]] | None:
        """Points that go the same way from the first picture into this one, and where they are in it."""
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


def _as_light(y: Plane, ratio: float) -> Plane:
    """Return the picture with its codes multiplied, unless that hardly changes it."""
    import cv2

    if abs(ratio - 1) < UNLIKE:
        return y
    return np.asarray(cv2.convertScaleAbs(y, alpha=ratio), np.uint8)


def _seen_from(y: Plane, factor: complex, shift: complex) -> Plane:
    """Return the picture as the camera of the first frame would have taken it."""
    if factor == 1 and shift == 0:
        return y
    view = np.array([[factor.real, -factor.imag, shift.real], [factor.imag, factor.real, shift.imag]])
    return resampled(y, view)


def _similar(
    body: NDArray[np.complex128], seen: NDArray[np.complex128], spread: Array, middle: complex
) -> tuple[complex, complex, NDArray[np.complex128], tuple[float, float, float]]:
    """Least squares of a turn, a factor and a shift, points that are off by more than usual counting less.

    Returns these, what is left at each point, and standard errors of u and v at `middle` and of the turn.
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
