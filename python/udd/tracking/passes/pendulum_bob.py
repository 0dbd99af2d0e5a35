"""A plain pendulum: one bob of one colour, its place in each frame and its angle about the pivot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.measurement import PENDULUM, Measurement, check_length
from udd.tracking.calibration.exposure import at_middle
from udd.tracking.correction import applied
from udd.tracking.detection.bob import (
    UNSEEN,
    Background,
    Blob,
    BobColour,
    UsualArea,
    bob_colour,
    locate_bobs,
    usual_area,
)
from udd.tracking.detection.camera_motion import CameraMotion
from udd.tracking.detection.frame_flags import BLACK, BLANK, REPEATED, lost, unread
from udd.tracking.detection.survey import Survey
from udd.tracking.geometry.pose import Pose
from udd.tracking.geometry.turns import count_turns_over_the_top, in_doubt
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, TrackError

from .double_pendulum import is_astray, scatter, with_lower_bob
from .frame_loop import Corrected, PoseSample, Prediction, Target, follow
from .frame_quality import remarks
from .inserted_copies import inserted_copies

Array = NDArray[np.float64]
RECENT = 5  # frames
ROUND = 0.03  # of the radius: a path that is off by more is no circle
WANDERS = 0.003  # of the radius: nor is one with so different distances in one direction ...
PLACED = 0.5  # pixels: a small bob's middle is known no better
SCATTERS = 4.0  # ... if that is so many times the frames' own scatter
BENDS = 6  # degree of the polynomial by which lens and tilt change the distance
FEWEST = 10  # frames that show the bob
TRIPLES = 200  # three points whose circle is tried
MOVED = 3.0  # pixels: a bob that was to move by less may look like a copy
STRAIGHT = 0.005  # of a path's length by which a lens may bend a straight one
SURE = 0.02  # of the length by which the pivot may be unsure


@dataclass(frozen=True)
class Circle:
    """The path of the bob: pivot and length [pixels] with standard errors, and what is left."""

    centre: complex
    radius: float
    sigma: tuple[float, float]
    rest: Array


def track_bob(
    film: Film,
    look_over: Survey,
    camera: CameraMotion | None,
    options: TrackOptions,
    tick: Callable[[Picture, Pose], object],
) -> Measurement:
    """Measure the pendulum's angle in each frame; the options' layout holds the colours of one bob or two.

    Raises
    ------
    TrackError
        No bob of that colour moves in the film, or its path does not show the pivot.
    """
    some = [burst[0] for burst in look_over.bursts if not burst[0].damaged]
    behind = Background.of(some, options.view(some[0].y.shape), film.full_range)
    bobs = []
    for rgb, chroma in zip(options.layout.colours, options.layout.chroma, strict=True):
        colour = bob_colour(film, some, behind, BobColour.of(rgb, chroma, film.full_range))
        bobs.append(Bob(behind, colour, usual_area(film, some, behind, colour)))
    paths = [bob_path(film, rows, options) for rows in follow(film, bobs, tick)]
    upper = _pendulum(film, paths[0], options, behind.grain, camera)
    if len(bobs) == 1:
        return upper
    lower = paths[1]
    return _checked(film, with_lower_bob(upper, paths[0].at, lower.at, lower.usual_area, str(film.path)))


class Bob(Target[Blob, tuple[float, str, Blob | None]]):
    """A pendulum's bob, as a target of the loop over the frames."""

    least_move = MOVED

    def __init__(self, behind: Background, colour: BobColour, usual: UsualArea) -> None:
        self.behind, self.colour, self.usual = behind, colour, usual
        self.areas: deque[float | None] = deque(maxlen=RECENT)  # of the last frames; None: not seen

    def unusable(self, picture: Picture) -> str:
        """Return the flag of a picture that shows nothing; empty if it may show something."""
        some, usual = picture.y[::8, ::8], self.behind.picture.y[::8, ::8].astype(np.int16)
        black = float(some.std()) < BLANK and float(np.abs(some - usual).mean()) > BLANK
        return unread(picture) or (BLACK if black else "")

    def surroundings(self, pose: Pose) -> tuple[NDArray[np.complex128], int, float]:
        """Return the bob's place, the pixels about it, and no reach."""
        return np.array([pose.centre]), int(1.5 * np.sqrt(self.usual.size)), 0.0

    def attempts(
        self, corrected: Corrected, picture: Picture, expected: Prediction | None
    ) -> Iterator[Blob | str]:
        """Find the patch of the bob's colour and size that is nearest to where the bob is expected."""
        patches = locate_bobs(picture, self.behind, self.colour)
        why = [self.usual.unlike(blob.area, self.areas) for blob in patches]
        fits = [blob for blob, unlike in zip(patches, why, strict=True) if not unlike]
        if expected is not None:
            fits.sort(key=lambda blob: abs(blob.centre - expected.pose.centre))
        self.areas.append(fits[0].area if fits else None)
        yield (fits or why or [UNSEEN])[0]

    def sample(self, seen: Blob, expected: Prediction | None, t: float) -> PoseSample:
        """Return the place of a result."""
        return PoseSample(t, Pose(seen.centre, 0.0))

    def row(self, t: float, flag: str, seen: Blob | None) -> tuple[float, str, Blob | None]:
        """Return time, flag and patch of a frame."""
        return t, flag, seen


def circle(points: NDArray[np.complex128]) -> Circle:
    """Fit a circle through points by least squares of the distances; outliers count less.

    It starts from the circle, through three points or by linear least squares of all, from which the others
    have the least median distance. A start from all points alone let one patch, of a shirt in the bob's
    colour, move the centre by a fifth of the radius.
    """
    from scipy.optimize import least_squares

    middle = points.mean()
    u, v = (points - middle).real, (points - middle).imag
    a, b, _ = np.linalg.lstsq(np.column_stack([u, v, np.ones(len(u))]), u**2 + v**2, rcond=None)[0]
    first, second, third = points[np.random.default_rng(0).integers(len(points), size=(TRIPLES, 3))].T
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (third - first) / (second - first)
        centres = first + (second - first) * (ratio - np.abs(ratio) ** 2) / (2j * ratio.imag)
    # Points on a line have no circle through three of them.
    centres = np.append(centres[np.isfinite(centres)], middle + complex(a, b) / 2)
    away = np.abs(points - centres[:, None])
    rests = away - np.median(away, axis=1)[:, None]
    best = int(np.argmin(np.median(np.abs(rests), axis=1)))
    start = centres[best] - middle
    usual = points[~is_astray(rests[best], 0.0)] - middle
    u, v = usual.real, usual.imag
    fit = least_squares(
        lambda p: np.hypot(u - p[0], v - p[1]) - p[2],
        [start.real, start.imag, float(np.median(away[best]))],
        loss="soft_l1",
        f_scale=0.2,
    )
    centre = complex(fit.x[0], fit.x[1]) + middle
    rest = np.abs(points - centre) - fit.x[2]
    spread = np.linalg.pinv(fit.jac.T @ fit.jac) * float(np.mean(np.minimum(fit.fun**2, 1.0)))
    return Circle(
        centre,
        float(fit.x[2]),
        (float(np.sqrt(spread[0, 0] + spread[1, 1])), float(np.sqrt(spread[2, 2]))),
        rest,
    )


def _exposure(t: Array, at: NDArray[np.complex128], moments: Array) -> tuple[float, float]:
    """Exposure and its standard error [s]: a streak of length l adds l^2 / 12 to the variance along it."""
    rate = np.gradient(at, t)
    along = rate / np.maximum(np.abs(rate), 1e-9)
    d = np.column_stack([along.real, along.imag])
    longer = np.einsum("ni,nij,nj->n", d, moments, d)
    across = np.einsum("nii->n", moments) - longer
    # the rod makes the bob longer across: a constant
    x, y = np.abs(rate) ** 2 / 12, longer - across
    spread = x - x.mean()
    if not spread.any():
        return 0.0, float("inf")
    square = float(spread @ y / (spread @ spread))
    rest = y - y.mean() - square * spread
    sigma = float(np.sqrt(np.mean(rest**2) / (spread @ spread)))
    if square < 3 * sigma:
        return 0.0, float("inf")
    return float(np.sqrt(square)), 0.5 * sigma / float(np.sqrt(square))


@dataclass(frozen=True)
class BobPath:
    """A bob in all frames: times, flags, places in mid-exposure, areas [pixels], and the exposure."""

    t: Array
    flag: list[str]
    at: NDArray[np.complex128]
    area: Array
    exposure: float  # [s]
    exposure_sigma: float

    @property
    def usual_area(self) -> float:
        """Median area [pixels] of the frames that show it."""
        return float(np.median(self.area[np.isfinite(self.at)]))


def bob_path(film: Film, rows: Sequence[tuple[float, str, Blob | None]], options: TrackOptions) -> BobPath:
    """Return the path of a bob, and the exposure by which it is blurred.

    Raises
    ------
    TrackError
        The bob is seen in fewer than 10 frames.
    """
    t = np.array([row[0] for row in rows])
    at = np.array([complex(np.nan, np.nan) if blob is None else blob.centre for *_, blob in rows])
    moments = np.array([np.full((2, 2), np.nan) if blob is None else blob.moments for *_, blob in rows])
    area = np.array([0.0 if blob is None else blob.area for *_, blob in rows])
    seen = np.isfinite(at)
    if seen.sum() < FEWEST:
        raise TrackError(f"{film.path}: the bob is seen in {seen.sum()} frames, at least {FEWEST} are needed")
    given = options.calibrate.given("exposure")
    open_for, open_sigma = (given, 0.0) if given is not None else _exposure(t[seen], at[seen], moments[seen])
    at, _ = at_middle(t, at, np.zeros(len(t)), open_for)
    return BobPath(t, [row[1] for row in rows], at, area, open_for, open_sigma)


def _wandering(at: NDArray[np.complex128], path: Circle) -> float:
    """Return the scatter of a bob's distance from the pivot in the same direction [pixels].

    Lens and tilt change the distance with the direction only; the lower bob of a double pendulum has another
    distance each time. Scatter within the errors of the frames is 0.
    """
    direction = np.angle((at - path.centre) / (at.mean() - path.centre))
    x = direction / max(float(np.abs(direction).max()), 1e-9)
    rest = path.rest - np.polyval(np.polyfit(x, path.rest, BENDS), x)
    noise = 1.48 * float(np.median(np.abs(np.diff(path.rest, 4)))) / 70**0.5
    off = 1.48 * float(np.median(np.abs(rest)))
    return off if off > SCATTERS * noise else 0.0


def _check_hanging(film: Film, at: NDArray[np.complex128], path: Circle, off: float, unsure: bool) -> None:
    """Refuse a path that is almost straight, or above its centre: no bob hangs so."""
    along = (path.centre - at.mean()) * 1j
    chord = float(np.ptp((at * np.conj(along / abs(along))).real))
    bend = chord**2 / (8 * path.radius)
    if chord < path.radius and max(bend, off) < STRAIGHT * chord:
        raise TrackError(
            f"{film.path}: the bob's path is almost straight: it bends by {bend:.1f} of {chord:.0f} pixels, "
            "as a lens bends a line. A rolling object is no pendulum; if this is one, give pivot=(u, v)"
        )
    if not unsure and ((at - path.centre).imag < 0).all():  # v goes down
        raise TrackError(
            f"{film.path}: the bob stays above the centre of its path, ({path.centre.real:.0f}, "
            f"{path.centre.imag:.0f}), so it does not hang there: turn the film if it is upside down, or "
            "give pivot=(u, v)"
        )


def _pendulum(
    film: Film, bob: BobPath, options: TrackOptions, noise: float, camera: CameraMotion | None
) -> Measurement:
    """Return the angle of a bob about the centre of its path."""
    t, flag, at, area = bob.t, bob.flag, bob.at.copy(), bob.area
    open_for, open_sigma, given = bob.exposure, bob.exposure_sigma, options.calibrate.given("exposure")
    seen = np.isfinite(at)
    path = circle(at[seen])
    on_it = ~is_astray(path.rest, bob.usual_area)
    seen[seen], path = on_it, replace(path, rest=path.rest[on_it])
    off = scatter(path.rest)
    wanders = _wandering(at[seen], path)
    unsure = options.pivot is None and path.sigma[0] > SURE * path.radius
    if options.pivot is None:
        _check_hanging(film, at[seen], path, off, unsure)
    wide = max(WANDERS * path.radius, PLACED)
    if off > ROUND * path.radius or wanders > (0.0 if unsure else wide):
        off = max(off, wanders)
        raise TrackError(
            f"{film.path}: the bob's path is no circle ({off:.1f} pixels off one of {path.radius:.0f}): is "
            "it the lower bob of a double pendulum (then give both colours, the upper one first), or "
            "does something else of that colour, such as a shirt, move (then say region)?"
        )
    pivot, pivot_sigma, origin = path.centre, path.sigma[0], "circle of the bob"
    if options.pivot is not None:
        pivot, pivot_sigma, origin = complex(*options.pivot), 0.0, "given"
        radius = float(np.median(np.abs(at[seen] - pivot)))
    elif unsure:
        raise TrackError(
            f"{film.path}: the bob's path is too short an arc to tell where the pivot is: give pivot=(u, v)"
        )
    else:
        radius = path.radius
    rest = np.abs(at - pivot) - radius
    astray = is_astray(rest, bob.usual_area)
    at[astray] = complex(np.nan, np.nan)
    flag = [
        lost("what has the bob's colour is not on its path") if a else f
        for a, f in zip(astray, flag, strict=True)
    ]
    seen = np.isfinite(at)
    # a mistake along the path is as large as one across it, which the circle shows
    spread = max(1.48 * float(np.median(np.abs(rest[seen] - np.median(rest[seen])))), 0.01)
    t, flag = inserted_copies(t, at, flag, spread)
    at[[text.startswith(REPEATED) for text in flag]] = complex(np.nan, np.nan)
    seen = np.isfinite(at)
    away = at - pivot
    turns = count_turns_over_the_top(t, np.arctan2(away.real, away.imag))
    rest = np.abs(away) - radius
    sigma = np.where(seen, spread / radius, np.nan)
    rate = np.abs(np.gradient(np.where(seen, at, np.nan), t))
    usual = bob.usual_area
    quality: dict[str, NDArray[Any]] = {
        "marks": seen.astype(np.int64),
        "complete": np.round(np.minimum(area / usual, 1.0), 4),
        "residual_px": np.where(seen, np.round(np.abs(rest), 5), np.nan),
        "blur_px": np.where(seen, np.round(rate * open_for, 3), np.nan),
        "method": np.where(seen, "fast", "none"),
    }
    quality |= applied(film).columns
    length = options.length
    scale = options.scale or (radius / length if length else None)
    how = "given" if options.scale else "length"
    meta: dict[str, Any] = {
        "source": film.path.name,
        "fps": film.fps,
        **({} if camera is None else camera.meta),
        **film.clock_meta,
        "frames": len(t),
        "frames_missing": max(0, film.promised - len(t)),
        "frames_lost": int((~seen).sum()),
        "exposure": open_for,
        "pivot_u": pivot.real,
        "pivot_v": pivot.imag,
        "pivot_from": origin,
        "length_px": radius,
        "bob_px": float(np.sqrt(usual / np.pi)),
        "marks_rgb": [list(colour) for colour in options.layout.colours],
        "grain": noise,
        "calibration": {
            "pivot": [[pivot.real, pivot.imag], pivot_sigma, origin],
            "length": [radius, 0.0 if origin == "given" else path.sigma[1], "circle of the bob [pixels]"],
            "exposure": [open_for, open_sigma if np.isfinite(open_sigma) else None,
                         "given" if given is not None else "found" if open_for else "none found"],
        },
    }  # fmt: skip
    if scale is not None:
        meta |= {"px_per_m": scale, "length": length if length else radius / scale}
        meta["calibration"]["scale"] = [
            scale,
            scale * path.sigma[1] / radius if how == "length" else 0.0,
            how,
        ]
    else:
        meta["px_per_m"] = None
    flag = remarks(t, flag, quality, False, in_doubt(turns))
    return _checked(film, Measurement(t, turns.angle, sigma, None, np.array(flag), meta, PENDULUM, quality))


def _checked(film: Film, m: Measurement) -> Measurement:
    try:
        check_length(m)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}") from None
    return m
