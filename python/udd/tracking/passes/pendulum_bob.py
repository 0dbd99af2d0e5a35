"""A plain pendulum: one bob of one colour, its place in each frame and its angle about the pivot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.measurement import PENDULUM, Measurement, check_length
from udd.tracking.calibration.exposure import at_middle
from udd.tracking.correction import applied
from udd.tracking.detection.camera_motion import CameraMotion, steadied
from udd.tracking.detection.colour_blobs import blobs
from udd.tracking.detection.frame_flags import BLACK, BLANK, DAMAGED, REPEATED, is_copy, lost
from udd.tracking.detection.survey import survey
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, TrackError
from udd.video.srgb import light_of

from .frame_quality import remarks
from .inserted_copies import inserted_copies

Array = NDArray[np.float64]
STRONG = 14.0  # of 127: how much more of its colour than the background a bob has
SMALL = 12  # pixels of colour that are no bob
SHARE = 0.4  # of its colour and light from which on a pixel counts as the bob's
HALF_HIDDEN = 0.93  # share of the size in the last frames below which the middle is not the bob's
TOO_MUCH = 1.15  # and above which something else of its colour is there
LEAST, MOST = 0.87, 1.2  # the same of the size in the whole film
RECENT = 5  # frames
ROUND = 0.03  # of the radius: a path that is off by more is no circle
MOVED = 3.0  # pixels: a bob that was to move by less may look like a copy
SURE = 0.02  # of the length by which the pivot may be unsure


@dataclass(frozen=True)
class Blob:
    """The bob in one picture: middle, size and second moments [pixels]."""

    centre: complex
    area: float
    moments: Array  # (2, 2)


@dataclass(frozen=True)
class Circle:
    """The path of the bob: pivot and length [pixels] with standard errors, and what is left."""

    centre: complex
    radius: float
    sigma: tuple[float, float]
    rest: Array


def track_bob(film: Film, options: TrackOptions, tick: Callable[[Picture], object]) -> Measurement:
    """The pendulum's angle in each frame; the options' layout is the bob's colour.

    Raises
    ------
    TrackError
        No bob of that colour moves in the film, or its path is too short an arc to tell the pivot.
    """
    look_over, camera = steadied(film, survey(film))
    some = [burst[0] for burst in look_over.bursts if not burst[0].damaged]
    behind, noise = _background(some)
    rows: list[tuple[float, str, Blob | None]] = []
    size = _size(film, some, behind, options)
    last: NDArray[np.uint8] | None = None
    path: list[complex] = []
    areas: deque[float | None] = deque(maxlen=RECENT)  # of the last frames; None: not seen
    for picture in film.pictures():
        tick(picture)
        blob, flag = None, _flag(picture, behind)
        if not flag:
            blob = locate_bob(picture, behind, options, None, film.full_range)
            if blob is not None and not _whole(blob.area, size, areas):
                blob = None
            areas.append(None if blob is None else blob.area)
            flag = "" if blob is not None else lost("the bob is not seen, or partly hidden")
        if blob is not None and last is not None and _copy(picture.y, last, blob, path):
            blob, flag = None, REPEATED
        if blob is not None:
            path = [*path[-2:], blob.centre]
        rows.append((picture.t, flag, blob))
        last = picture.y
    return _angles(film, rows, options, noise, camera)


def _whole(area: float, size: float, recent: Iterable[float | None]) -> bool:
    """Whether a bob is seen whole: light changes its size little by little, what hides it does so at once."""
    seen = [a for a in recent if a is not None]
    usual = float(np.median(seen)) if seen else size
    return LEAST * size < area < MOST * size and HALF_HIDDEN * usual < area < TOO_MUCH * usual


def _background(some: Sequence[Picture]) -> tuple[Picture, float]:
    """What stands still: the median of pictures all over the film; and the grain about it [codes]."""
    planes = [np.stack([getattr(p, name) for p in some]) for name in ("y", "u", "v")]
    middle = [np.median(x, axis=0).astype(np.uint8) for x in planes]
    grain = np.abs(planes[0][:, ::4, ::4].astype(np.int16) - middle[0][::4, ::4])
    return Picture(0, 0.0, *middle), float(1.48 * np.median(grain[grain > 0])) if (grain > 0).any() else 1.0


def _flag(picture: Picture, behind: Picture) -> str:
    if picture.damaged:
        return DAMAGED
    some, usual = picture.y[::8, ::8], behind.y[::8, ::8].astype(np.int16)
    black = float(some.std()) < BLANK and float(np.abs(some - usual).mean()) > BLANK
    return BLACK if black else ""


def _more(picture: Picture, behind: Picture, options: TrackOptions) -> NDArray[np.float32]:
    """How much more of the colour than the background has each pixel, at half the resolution."""
    chroma = options.layout.chroma[0]
    a, b = (chroma / np.hypot(*chroma)).astype(np.float32)
    du, dv = picture.u.astype(np.float32) - behind.u, picture.v.astype(np.float32) - behind.v
    inside = options.view(picture.y.shape)[::2, ::2][: du.shape[0], : du.shape[1]]
    return np.where(inside, a * du + b * dv, np.float32(0))


def _size(film: Film, some: Sequence[Picture], behind: Picture, options: TrackOptions) -> float:
    """The bob's usual area [pixels]."""
    blobs_seen = [locate_bob(p, behind, options, None, film.full_range) for p in some]
    areas = [blob.area for blob in blobs_seen if blob is not None]
    if len(areas) < 5:
        raise TrackError(f"{film.path}: no bob of that colour moves in this film")
    return float(np.median(areas))


def locate_bob(
    picture: Picture, behind: Picture, options: TrackOptions, size: float | None, full_range: bool = False
) -> Blob | None:
    """The middle of the largest patch that has the colour, weighted by how much of each pixel is the bob's.

    A pixel's share is the part of the way from the background's light to the bob's, in three colours. A patch
    that is not of the usual `size` is hidden in part, or not the bob alone.
    """
    import cv2

    more = _more(picture, behind, options)
    found = blobs(more > STRONG, SMALL // 4, 1)
    if not len(found.centre):
        return None
    middle, reach = complex(found.centre[0]), 0.5 * np.sqrt(found.area[0]) * 1.6 + 8
    r0, r1 = max(0, int(middle.imag - reach)) & ~1, min(picture.y.shape[0], int(middle.imag + reach) + 1)
    c0, c1 = max(0, int(middle.real - reach)) & ~1, min(picture.y.shape[1], int(middle.real + reach) + 1)
    shape, half = (r1 - r0, c1 - c0), (slice(r0 // 2, (r1 + 1) // 2), slice(c0 // 2, (c1 + 1) // 2))
    change = _light(picture, (r0, r1, c0, c1), full_range) - _light(behind, (r0, r1, c0, c1), full_range)
    solid = cv2.resize(
        (more[half] > 2 * STRONG).astype(np.uint8), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST
    )[: shape[0], : shape[1]]
    if solid.sum() < SMALL:
        return None
    full = np.median(change[solid > 0], axis=0)
    share = np.clip(change @ full / float(full @ full), 0, 1.1)
    near = cv2.dilate((share > SHARE).astype(np.uint8) & cv2.dilate(solid, np.ones((3, 3), np.uint8)),
                      np.ones((7, 7), np.uint8))  # fmt: skip
    weight = np.where(near > 0, share, 0).astype(np.float64)
    area = float(weight.sum())
    if size is not None and not HALF_HIDDEN * size < area < TOO_MUCH * size:
        return None
    v, u = np.mgrid[r0:r1, c0:c1]
    cu, cv = (weight * u).sum() / area, (weight * v).sum() / area
    uu, vv = (weight * (u - cu) ** 2).sum() / area, (weight * (v - cv) ** 2).sum() / area
    uv = (weight * (u - cu) * (v - cv)).sum() / area
    return Blob(complex(cu, cv), area, np.array([[uu, uv], [uv, vv]]))


def _light(picture: Picture, box: tuple[int, int, int, int], full_range: bool) -> NDArray[np.float32]:
    """Red, green and blue light of a part of a picture, (rows, columns, 3), which a shutter adds up."""
    import cv2

    r0, r1, c0, c1 = box
    half = slice(r0 // 2, (r1 + 1) // 2), slice(c0 // 2, (c1 + 1) // 2)
    y = picture.y[r0:r1, c0:c1].astype(np.float32)
    u, v = (
        cv2.resize(p[half].astype(np.float32) - 128, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR)
        for p in (picture.u, picture.v)
    )
    u, v = u[: r1 - r0, : c1 - c0], v[: r1 - r0, : c1 - c0]
    if not full_range:
        y, u, v = (y - 16) * (255 / 219), u * (255 / 224), v * (255 / 224)
    codes = np.stack([y + 1.402 * v, y - 0.344 * u - 0.714 * v, y + 1.772 * u], axis=-1) / 255
    codes = np.clip(codes, 0, 1)
    light = light_of(codes)
    return np.asarray(light, dtype=np.float32)


def _copy(y: NDArray[np.uint8], last: NDArray[np.uint8], blob: Blob, path: Sequence[complex]) -> bool:
    """Whether a frame repeats the last although the bob was moving."""
    if len(path) < 3 or abs(2 * (path[-1] - path[-2]) - (path[-2] - path[-3])) < MOVED:
        return False  # it was about to stand still
    return is_copy(y, last, [blob.centre], int(1.5 * np.sqrt(blob.area)))


def circle(points: NDArray[np.complex128]) -> Circle:
    """The circle through points, least squares of the distances, outliers counting less."""
    from scipy.optimize import least_squares

    u, v = points.real - points.real.mean(), points.imag - points.imag.mean()
    a, b, c = np.linalg.lstsq(np.column_stack([u, v, np.ones(len(u))]), u**2 + v**2, rcond=None)[0]
    start = [a / 2, b / 2, np.sqrt(max(c + a * a / 4 + b * b / 4, 1.0))]
    fit = least_squares(lambda p: np.hypot(u - p[0], v - p[1]) - p[2], start, loss="soft_l1", f_scale=0.2)
    rest = np.hypot(u - fit.x[0], v - fit.x[1]) - fit.x[2]
    spread = np.linalg.pinv(fit.jac.T @ fit.jac) * float(np.mean(np.minimum(rest**2, 1.0)))
    centre = complex(fit.x[0] + points.real.mean(), fit.x[1] + points.imag.mean())
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


def _angles(
    film: Film,
    rows: list[tuple[float, str, Blob | None]],
    options: TrackOptions,
    noise: float,
    camera: CameraMotion | None,
) -> Measurement:
    t = np.array([row[0] for row in rows])
    flag = [row[1] for row in rows]
    at = np.array([complex(np.nan, np.nan) if blob is None else blob.centre for *_, blob in rows])
    moments = np.array([np.full((2, 2), np.nan) if blob is None else blob.moments for *_, blob in rows])
    area = np.array([0.0 if blob is None else blob.area for *_, blob in rows])
    seen = np.isfinite(at)
    if seen.sum() < 10:
        raise TrackError(f"{film.path}: the bob is seen in {seen.sum()} frames, at least 10 are needed")
    given = options.calibrate.given("exposure")
    open_for, open_sigma = (given, 0.0) if given is not None else _exposure(t[seen], at[seen], moments[seen])
    at, _ = at_middle(t, at, np.zeros(len(t)), open_for)
    path = circle(at[seen])
    off = 1.48 * float(np.median(np.abs(path.rest - np.median(path.rest))))
    if off > ROUND * path.radius:
        raise TrackError(
            f"{film.path}: the bob's path is no circle ({off:.1f} pixels off one of {path.radius:.0f}): is "
            "it the lower bob of a double pendulum, or are there several of that colour (then say region)?"
        )
    pivot, pivot_sigma, origin = path.centre, path.sigma[0], "circle of the bob"
    if options.pivot is not None:
        pivot, pivot_sigma, origin = complex(*options.pivot), 0.0, "given"
        radius = float(np.median(np.abs(at[seen] - pivot)))
    elif path.sigma[0] > SURE * path.radius:
        raise TrackError(
            f"{film.path}: the bob's path is too short an arc to tell where the pivot is: give pivot=(u, v)"
        )
    else:
        radius = path.radius
    rest = np.abs(at - pivot) - radius
    # a mistake along the path is as large as one across it, which the circle shows
    spread = max(1.48 * float(np.median(np.abs(rest[seen] - np.median(rest[seen])))), 0.01)
    t, flag = inserted_copies(t, at, flag, spread)
    at[[one.startswith(REPEATED) for one in flag]] = complex(np.nan, np.nan)
    seen = np.isfinite(at)
    away = at - pivot
    theta = np.full(len(t), np.nan)
    theta[seen] = np.unwrap(np.arctan2(away[seen].real, away[seen].imag))
    rest = np.abs(away) - radius
    sigma = np.where(seen, spread / radius, np.nan)
    rate = np.abs(np.gradient(np.where(seen, at, np.nan), t))
    usual = float(np.median(area[seen]))
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
        **({"clock": film.clock_text} if film.clock_text else {}),
        "frames": len(t),
        "frames_missing": max(0, film.promised - len(t)),
        "frames_lost": int((~seen).sum()),
        "exposure": open_for,
        "pivot_u": pivot.real,
        "pivot_v": pivot.imag,
        "pivot_from": origin,
        "length_px": radius,
        "bob_px": float(np.sqrt(usual / np.pi)),
        "marks_rgb": [list(options.layout.colours[0])],
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
    flag = remarks(t, flag, quality, False)
    m = Measurement(t, theta, sigma, None, np.array(flag), meta, PENDULUM, quality)
    try:
        check_length(m)
    except ValueError as error:
        raise TrackError(f"{film.path}: {error}") from None
    return m
