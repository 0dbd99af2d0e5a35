"""Printed tags (ArUco, AprilTag) on the disk, found by OpenCV: their corners through the same rigid body."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import similarity
from udd.markers.tags import dictionary
from udd.tracking.calibration.exposure import Exposure
from udd.tracking.calibration.rolling_shutter import Readout
from udd.tracking.detection.frame_flags import lost
from udd.tracking.detection.tag_corners import sharpened
from udd.tracking.geometry.lens import calibrate
from udd.tracking.geometry.pose import DiskAppearance, Mark, Pose
from udd.tracking.marks.localization import Sighting
from udd.tracking.marks.pose_fit import Fit
from udd.tracking.marks.rigid_fit import solve
from udd.tracking.options import TrackOptions
from udd.video.reader import Film, Picture, TrackError

from .first_pass import SURROUNDINGS, TrackerState
from .frame_loop import Corrected, PoseSample, Prediction, Target, follow
from .preparation import exposure_estimate, lens_estimates, readout_estimate
from .tracks import FrameTrack, Tracks, found_in, lost_in

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]
FEWEST = 10  # frames with a tag
CORNER = 0.02  # pixels: how well a corner is placed at best; the film says how much worse
ABOUT = 8.0  # pixels about a corner that show whether a frame is a copy
OFF = 3.0  # pixels by which a corner may disagree
FOR_LENS = 400  # frames at most from which tilt and lens are measured


class TaggedDisk(Target[Complexes, tuple[float, str, Complexes]]):
    """A disk with printed tags, as a target of the loop over the frames; a result is its corners (n,)."""

    def __init__(self, film: Film, options: TrackOptions) -> None:
        import cv2

        tags, how = options.tags, cv2.aruco.DetectorParameters()
        how.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self.light = film.light.astype(np.float32)
        self.cells = int(dictionary(tags[0].dictionary).markerSize) + 2
        self.options, self.row_of = options, {tag.number: k for k, tag in enumerate(tags)}
        self.detector = cv2.aruco.ArucoDetector(dictionary(tags[0].dictionary), how)
        self.body, self.size = options.layout.unit, 1.0  # the last size [pixels]

    def surroundings(self, pose: Pose) -> tuple[Complexes, int, float]:
        """Return the corners' places, the pixels about each, and their reach [pixels]."""
        body = self.size * self.body
        about = int(SURROUNDINGS * np.hypot(ABOUT, ABOUT))
        return pose.centre + body * np.exp(1j * pose.angle), about, float(np.abs(body).max())

    def attempts(
        self, corrected: Corrected, picture: Picture, expected: Prediction | None
    ) -> Iterator[Complexes | str]:
        """Read the tags anywhere in the picture."""
        at = self.corners(picture)
        yield at if np.isfinite(at).any() else "no tag is seen"

    def sample(self, seen: Complexes, expected: Prediction | None, t: float) -> PoseSample:
        """Return the pose of a result, without perspective."""
        pose, self.size = _rough(seen, self.body)
        if expected is not None:
            pose.angle += 2 * np.pi * round((expected.pose.angle - pose.angle) / (2 * np.pi))
        return PoseSample(t, pose)

    def row(self, t: float, flag: str, seen: Complexes | None) -> tuple[float, str, Complexes]:
        """Return time, flag and corners of a frame."""
        return t, flag, np.full(len(self.body), complex(np.nan, np.nan)) if seen is None else seen

    def corners(self, picture: Picture) -> Complexes:
        """Return the corners of the layout's tags in a picture (n,), NaN where not seen."""
        out = np.full((len(self.row_of), 4), complex(np.nan, np.nan))
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
            if int(number) in self.row_of:
                u, v = np.reshape(at, (4, 2)).T
                sharp = sharpened(light, u + 1j * v + away, self.cells)
                if sharp is not None:
                    out[self.row_of[int(number)]] = sharp
        return out.ravel()


def follow_tags(
    film: Film, options: TrackOptions, tick: Callable[[Picture, Pose], object]
) -> tuple[Tracks, TrackerState]:
    """Find the tags in every picture and lay one rigid body through their corners.

    Raises
    ------
    TrackError
        The film is empty, or fewer than 10 frames show a tag.
    """
    (rows,) = follow(film, [TaggedDisk(film, options)], tick)
    points = np.array([at for *_, at in rows]).reshape(-1, len(options.layout.unit))
    frames = int(np.isfinite(points).any(axis=1).sum())
    if frames < FEWEST:
        raise TrackError(
            f"{film.path}: the layout's tags are read in {frames} of "
            f"{len(points)} frames; at least {FEWEST} are needed. Show the whole tag with its white margin, "
            "sharp; check its dictionary and number"
        )
    return _laid(points, [(t, flag) for t, flag, _ in rows], film, options)


def _rough(at: Complexes, body: Complexes) -> tuple[Pose, float]:
    """Fit the body through points at any size: pose and size."""
    ok = np.isfinite(at)
    centre, turn = similarity(body[ok], at[ok])
    return Pose(centre, float(np.angle(turn))), abs(turn)


def _laid(
    points: Complexes,
    notes: list[tuple[float, str]],
    film: Film,
    options: TrackOptions,
) -> tuple[Tracks, TrackerState]:
    """Lens, size and layout from all frames; then every frame's pose."""
    body, wanted, shape = options.layout.unit, options.calibrate, film.size[::-1]
    good = np.flatnonzero(np.isfinite(points).sum(axis=1) >= 4)
    some = good[:: max(1, len(good) // FOR_LENS)]
    lens_fit = calibrate(points[some], shape, body, wanted.given("lens"), wanted.given("tilt"))
    flat = lens_fit.lens.plane(points)
    size = float(np.median([_rough(flat[k], body)[1] for k in good]))
    places = size * body
    for _ in range(2 if wanted.layout else 0):
        places = places + _displaced(flat[good], places)
    marks = [Mark(complex(z), (0.0, 0.0), 0.0, 0.0) for z in places]
    look = DiskAppearance(marks, 0.0, 1.0, film.light, np.inf, lens_fit.lens)
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
        **lens_estimates(lens_fit, look.lens, wanted),
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
