"""Other trackers: an OpenCV colour tracker, trackpy, OpenCV's CSRT. They get colours, scale and pivot.

Each gives the marks' centres in a frame; one least-squares rigid fit makes Y, Z and beta of them.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import av
import cv2
import numpy as np
from films import Case
from numpy.typing import NDArray
from scoring import Score, score

from udd.film import Film

Array = NDArray[np.float64]
REACH, SIDE = 0.065, 0.016  # m
HUES = ((-8, 8), (8, 20), (100, 125), (50, 85))  # OpenCV's, 0 to 180: red, orange, blue, green
BODY = np.array([-1j, 1, 1j, -1])


def pictures(film: Film) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    """Times and BGR pictures."""
    with av.open(str(film.path)) as container:
        for frame in container.decode(video=0):
            yield float(frame.time or 0.0), frame.to_ndarray(format="bgr24")


def mask_of(hsv: NDArray[np.uint8], k: int) -> NDArray[np.uint8]:
    """Pixels of the k-th mark's colour."""
    low, high = HUES[k]
    hue = (hsv[..., 0].astype(np.int16) + 90) % 180 - 90 if low < 0 else hsv[..., 0]
    return ((hue >= low) & (hue <= high) & (hsv[..., 1] > 150) & (hsv[..., 2] > 50)).astype(np.uint8)


def pose(marks: NDArray[np.complex128], film: Film) -> tuple[complex, float]:
    """Least-squares centre and angle of the marks that are seen (pixels)."""
    ok = np.isfinite(marks)
    if ok.sum() < 2:
        return complex(np.nan, np.nan), np.nan
    body = BODY[ok] * REACH * film.scale
    seen = marks[ok]
    turn = np.vdot(body - body.mean(), seen - seen.mean())
    turn /= abs(turn)
    return complex(seen.mean() - turn * body.mean()), float(np.angle(turn))


def measured(case: Case, film: Film, find: Callable[[NDArray[np.uint8]], NDArray[np.complex128]]) -> Score:
    """Run a finder of marks over the film."""
    begun = time.perf_counter()
    t, centre, angle = [], [], []
    for time_, picture in pictures(film):
        c, a = pose(find(picture), film)
        t.append(time_)
        centre.append(c)
        angle.append(a)
    rate = len(t) / (time.perf_counter() - begun)
    away = (np.array(centre) - complex(*film.pivot)) / film.scale
    beta = np.array(angle)
    seen = np.isfinite(beta)
    # whole turns from the truth: only the places compare
    true = np.interp(np.array(t), film.t, film.state[:, 3])
    beta[seen] += 2 * np.pi * np.round((true[seen] - beta[seen]) / (2 * np.pi))
    return score(case, film, np.array(t), np.column_stack([away.real, -away.imag, beta]), None, rate)


def colour(case: Case, film: Film) -> Score:
    """Threshold in HSV, the largest patch of each colour, its centroid."""
    least = 0.25 * (SIDE * film.scale) ** 2

    def find(picture: NDArray[np.uint8]) -> NDArray[np.complex128]:
        hsv = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2HSV), dtype=np.uint8)
        out = np.full(4, complex(np.nan, np.nan))
        for k in range(4):
            count, _, stats, middle = cv2.connectedComponentsWithStats(mask_of(hsv, k))
            if count > 1:
                best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
                if stats[best, cv2.CC_STAT_AREA] > least:
                    out[k] = complex(*middle[best])
        return out

    return measured(case, film, find)


def particles(case: Case, film: Film) -> Score:
    """trackpy's sub-pixel features of each colour's mask."""
    import trackpy

    trackpy.quiet()
    warnings.filterwarnings("ignore", module="trackpy")  # a hidden mark is no news
    diameter = 2 * round(0.6 * SIDE * film.scale) + 1

    def find(picture: NDArray[np.uint8]) -> NDArray[np.complex128]:
        hsv = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2HSV), dtype=np.uint8)
        out = np.full(4, complex(np.nan, np.nan))
        for k in range(4):
            mask = mask_of(hsv, k)
            count, _, stats, _ = cv2.connectedComponentsWithStats(mask)
            if count < 2:
                continue
            # its search for maxima takes seconds on a whole picture: only about the largest patch, then
            x, y, w, h, _ = stats[1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))]
            left, top = max(0, x - diameter), max(0, y - diameter)
            part = mask[top : y + h + diameter, left : x + w + diameter]
            soft = cv2.GaussianBlur(255 * part, (0, 0), 0.3 * SIDE * film.scale)
            spots: Any = trackpy.locate(soft, diameter, topn=1, preprocess=False)
            if len(spots):
                out[k] = complex(spots["x"].iloc[0] + left, spots["y"].iloc[0] + top)
        return out

    return measured(case, film, find)


def correlation(case: Case, film: Film) -> Score:
    """OpenCV's CSRT on each mark, started on its true place in the first frame."""
    make = getattr(cv2, "TrackerCSRT_create", None) or cv2.legacy.TrackerCSRT_create
    _, y, z, beta = film.state[0]
    centre = complex(*film.pivot) + film.scale * (y - 1j * z)
    marks = centre + BODY * REACH * film.scale * np.exp(1j * beta)
    side = round(1.6 * SIDE * film.scale)
    trackers: list[Any] = []

    def find(picture: NDArray[np.uint8]) -> NDArray[np.complex128]:
        out = np.full(4, complex(np.nan, np.nan))
        if not trackers:
            for m in marks:
                tracker = make()
                tracker.init(picture, (round(m.real - side / 2), round(m.imag - side / 2), side, side))
                trackers.append(tracker)
            return np.asarray(marks)
        for k, tracker in enumerate(trackers):
            ok, (x, y0, w, h) = tracker.update(picture)
            if ok:
                out[k] = complex(x + (w - 1) / 2, y0 + (h - 1) / 2)
        return out

    return measured(case, film, find)


TRACKERS: dict[str, Callable[[Case, Film], Score]] = {"HSV": colour}
try:
    import trackpy  # noqa: F401

    TRACKERS["trackpy"] = particles
except ImportError:
    pass
if hasattr(cv2, "TrackerCSRT_create") or hasattr(getattr(cv2, "legacy", None), "TrackerCSRT_create"):
    TRACKERS["CSRT"] = correlation
