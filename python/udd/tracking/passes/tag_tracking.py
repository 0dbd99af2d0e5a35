"""Printed tags (ArUco, AprilTag) on the disk, found by OpenCV: their corners through the same rigid body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import laid
from udd.markers.tags import Tag, dictionary
from udd.tracking.calibration.exposure import Exposure
from udd.tracking.calibration.rolling_shutter import Readout
from udd.tracking.detection.frame_flags import REPEATED, lost, unusable
from udd.tracking.detection.tag_corners import sharpened
from udd.tracking.geometry.lens import calibrate
from udd.tracking.geometry.pose import DiskAppearance, Mark, Pose
from udd.tracking.marks.localization import Sighting
from udd.tracking.marks.pose_fit import Fit
from udd.tracking.marks.rigid_fit import solve
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, TrackError

from .first_pass import PoseSample, TrackerState, predict, repeats
from .preparation import exposure_estimate, lens_estimates, readout_estimate
from .tracks import FrameTrack, Tracks, found_in, lost_in

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]
FEWEST = 10  # frames with a tag
CORNER = 0.02  # pixels: how well a corner is placed at best; the film says how much worse
ABOUT = 8.0  # pixels about a corner that show whether a frame is a copy
OFF = 3.0  # pixels by which a corner may disagree
FOR_LENS = 400  # frames at most from which tilt and lens are measured


class Finder:
    """Corners of the known tags in a picture (n, NaN where not seen)."""

    def __init__(self, tags: Sequence[Tag], options: TrackOptions, light: Array) -> None:
        import cv2

        how = cv2.aruco.DetectorParameters()
        how.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self.light, self.cells = light.astype(np.float32), int(dictionary(tags[0].dictionary).markerSize) + 2
        self.options, self.row = options, {tag.number: k for k, tag in enumerate(tags)}
        self.detector = cv2.aruco.ArucoDetector(dictionary(tags[0].dictionary), how)

    def __call__(self, picture: Picture) -> Complexes:
        """Look at one picture."""
        out = np.full((len(self.row), 4), complex(np.nan, np.nan))
        y, away = picture.y, 0j
        if self.options.region is not None:
            inside = self.options.view(y.shape)
            rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
            y = np.ascontiguousarray(y[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
            away = complex(columns[0], rows[0])
        corners, numbers, _ = self.detector.detectMarkers(y)
        if not corners:
            return out.ravel()
        light = self.light[picture.y]
        for number, at in zip(np.ravel(numbers), corners, strict=False):
            if int(number) in self.row:
                u, v = np.reshape(at, (4, 2)).T
                sharp = sharpened(light, u + 1j * v + away, self.cells)
                if sharp is not None:
                    out[self.row[int(number)]] = sharp
        return out.ravel()


def follow_tags(
    film: Film,
    pictures: Iterable[Picture],
    options: TrackOptions,
    tick: Callable[[Picture, Pose], object],
) -> tuple[Tracks, TrackerState]:
    """Find the tags in every picture and lay one rigid body through their corners.

    Raises
    ------
    TrackError
        The film is empty, or fewer than 10 frames show a tag.
    """
    find, body = Finder(options.tags, options, film.light), options.layout.unit
    seen: list[Complexes] = []
    notes: list[tuple[float, str]] = []
    last: NDArray[np.uint8] | None = None
    shape = (film.size[1], film.size[0])
    past: list[PoseSample] = []
    rough = _rough_look(film, options)
    for picture in pictures:
        shape = (picture.y.shape[0], picture.y.shape[1])
        at, flag = np.full(len(body), complex(np.nan, np.nan)), unusable(picture)
        pose = Pose(complex(np.nan, np.nan), np.nan)
        if not flag:
            at = find(picture)
            flag = "" if np.isfinite(at).any() else lost("no tag is seen")
        if not flag:
            pose, factor = _rough(at, body)
            rough = replace(
                rough, marks=[replace(m, place=factor * z) for m, z in zip(rough.marks, body, strict=True)]
            )
            guess = predict(past, picture.t, None)
            if guess is not None and last is not None:
                pose.angle += 2 * np.pi * round((guess.angle - pose.angle) / (2 * np.pi))
                if repeats(picture.y, last, guess, past[-1].pose, rough):
                    at[:], flag = complex(np.nan, np.nan), REPEATED
            if not flag:
                past = [*past[-2:], PoseSample(picture.t, pose, 0.0)]
        last = picture.y
        seen.append(at)
        notes.append((picture.t, flag))
        tick(picture, pose)
    points = np.array(seen).reshape(-1, len(body))
    if np.isfinite(points).any(axis=1).sum() < FEWEST:
        raise TrackError(
            f"{film.path}: the layout's tags are read in {np.isfinite(points).any(axis=1).sum()} of "
            f"{len(points)} frames; at least {FEWEST} are needed. Show the whole tag with its white margin, "
            "sharp; check its dictionary and number"
        )
    return _laid(points, notes, film, options, shape)


def _rough(at: Complexes, body: Complexes) -> tuple[Pose, float]:
    """Fit the body through points at any size: pose and size."""
    ok = np.isfinite(at)
    centre, turn = laid(body[ok], at[ok])
    return Pose(centre, float(np.angle(turn))), abs(turn)


def _rough_look(film: Film, options: TrackOptions) -> DiskAppearance:
    marks = [Mark(complex(z), (ABOUT, ABOUT), 0.0, 0.0) for z in options.layout.unit]
    return DiskAppearance(marks, 0.0, 1.0, film.light, np.inf)


def _laid(
    points: Complexes,
    notes: list[tuple[float, str]],
    film: Film,
    options: TrackOptions,
    shape: tuple[int, int],
) -> tuple[Tracks, TrackerState]:
    """Lens, size and layout from all frames; then every frame's pose."""
    body, wanted = options.layout.unit, options.calibrate
    good = np.flatnonzero(np.isfinite(points).sum(axis=1) >= 4)
    some = good[:: max(1, len(good) // FOR_LENS)]
    bent = calibrate(points[some], shape, body, wanted.given("lens"), wanted.given("tilt"))
    flat = bent.lens.plane(points)
    size = float(np.median([_rough(flat[k], body)[1] for k in good]))
    places = size * body
    for _ in range(2 if wanted.layout else 0):
        places = places + _displaced(flat[good], places)
    marks = [Mark(complex(z), (0.0, 0.0), 0.0, 0.0) for z in places]
    look = DiskAppearance(marks, 0.0, 1.0, film.light, np.inf, bent.lens)
    frames: list[FrameTrack] = []
    angle = 0.0
    for at, (t, flag) in zip(flat, notes, strict=True):
        pose, fit = Pose(complex(np.nan, np.nan), np.nan), None
        if not flag:
            pose = _rough(at, body)[0]
            fit = _fit(at, pose, look)
            flag = "" if fit is not None else lost("the tags disagree")
        if fit is None:
            frames.append(lost_in(t, flag, np.nan, len(marks)))
        else:
            pose.angle += 2 * np.pi * round((angle - pose.angle) / (2 * np.pi))
            angle = pose.angle
            frames.append(found_in(t, fit, pose, np.nan, "fast"))
    open_for, readout = wanted.given("exposure"), wanted.given("readout")
    estimates = {
        **lens_estimates(bent, look.lens, wanted),
        **readout_estimate(Readout(readout or 0.0, np.inf if readout is None else 0.0), wanted),
        **exposure_estimate(Exposure(open_for or 0.0, np.inf if open_for is None else 0.0), wanted),
    }
    view, colours = np.ones(shape, dtype=bool), np.zeros((len(marks), 2))
    state = TrackerState(look, view, colours, open_for or 0.0, 255.0, None, estimates)
    return Tracks.of(frames), state


def _displaced(points: Complexes, places: Complexes) -> Complexes:
    """Return the mean offset of the marks from their places, in the frame of the body."""
    off = np.full(points.shape, complex(np.nan, np.nan))
    for row, at in zip(off, points, strict=True):
        ok = np.isfinite(at)
        z, w = places[ok], at[ok]
        turn = complex(np.vdot(z - z.mean(), w - w.mean()))
        turn /= abs(turn)
        row[ok] = (w - w.mean()) / turn - (z - z.mean())
    moved = np.array([np.nanmedian(x.real) + 1j * np.nanmedian(x.imag) for x in off.T])
    return np.asarray(moved - moved.mean(), dtype=np.complex128)


def _fit(at: Complexes, pose: Pose, look: DiskAppearance) -> Fit | None:
    """Gauss-Newton on the corners; what disagrees by pixels is left out."""
    used = np.isfinite(at)
    for _ in range(3):
        expected = pose.centre + look.places * np.exp(1j * pose.angle)
        off = np.where(used, at - expected, 0)
        sightings = [
            Sighting(np.array([d.real, d.imag]), np.eye(2) / CORNER**2, 1.0, 1.0, 0.0, 1.0, (0, 0, 0, 0))
            if ok
            else None
            for d, ok in zip(off, used, strict=True)
        ]
        step = solve(look.marks, sightings, pose.angle, used.astype(float))
        if step is None:
            return None
        pose.centre += complex(step.change[0], step.change[1])
        pose.angle += float(step.change[2])
        far = np.hypot(*step.residuals.T)
        fit = Fit(step, sightings, used, float(np.hypot(*step.change[:2])))
        worst = np.nan_to_num(far) > OFF
        if worst.any() and used.sum() > 4:
            used = used & ~np.repeat(worst.reshape(-1, 4).any(axis=1), 4)
            if used.sum() < 4:
                return None
    return None if worst.any() else fit
