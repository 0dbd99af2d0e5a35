"""The calibration from the film: the camera that gives places in metres, and a table of all items."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.calibration_items import Estimate, table
from udd.errors import outside
from udd.tracking.calibration.scale import DISAGREES, MINOR, Scale
from udd.tracking.geometry.contact_point import pivot as rolling
from udd.tracking.geometry.contact_point import support
from udd.tracking.geometry.lens import Lens, middle_of
from udd.tracking.options import TrackOptions
from udd.tracking.passes.first_pass import TrackerState
from udd.tracking.passes.tracks import Tracks
from udd.tracking.passes.wobble import Wobble
from udd.video.reader import Film, TrackError

from .doubts import NO_CONTACT
from .pixels_to_metres import Camera

CLOSE_ENOUGH = 6.0  # mm: error of a contact that the support alone shows
BLOCKS = 20  # stretches of the film whose means are the independent pieces


def camera_of(tracks: Tracks, state: TrackerState, size: Scale, options: TrackOptions) -> Camera:
    """Determine scale and contact: from the rolling constraint, as given, or at worst from the support.

    A contact that is given with a standard error is averaged with that of the rolling constraint, by weight.

    Raises
    ------
    TrackError
        Neither the motion nor a support shows the contact, and it is not given.
    """
    angle, centre = tracks.angle, tracks.centre
    good = np.isfinite(angle)
    contact = rolling(tracks.t, centre, angle, good, state.look.reach)
    drive, drive_sigma = complex(np.nan, np.nan), np.nan
    if contact is not None:
        drive = complex(np.conj(contact.drive) / size.value)
        drive_sigma = float(np.hypot(contact.drive_sigma / size.value, abs(drive) * size.sigma / size.value))

    def camera(place: complex, sigma: float, origin: str) -> Camera:
        return Camera(size.value, size.sigma, size.origin, place, sigma, origin, drive, drive_sigma)

    if options.pivot is not None:
        place, given_sigma = complex(state.look.lens.plane(complex(*options.pivot))), options.sigma.pivot
        if contact is None or not given_sigma or not options.calibrate.pivot:
            return camera(place, given_sigma / size.value, "given")
        of_film = float(contact.covariance[0, 0])
        if abs(contact.place - place) < DISAGREES * np.hypot(given_sigma, np.sqrt(of_film)):
            share = of_film / (of_film + given_sigma**2)  # of the given place
            sigma = float(np.sqrt(share) * given_sigma) / size.value
            how = "rolling constraint" if share < MINOR else "rolling constraint and given"
            return camera(contact.place + share * (place - contact.place), sigma, how)
        warnings.warn(
            f"the disk turns about a point {abs(contact.place - place):.0f} pixels from the pivot that is "
            "given; the contact of the motion is used",
            stacklevel=outside(),
        )
    if contact is not None:
        return camera(
            contact.place, float(np.sqrt(contact.covariance[0, 0])) / size.value, "rolling constraint"
        )
    guess = support(state.view)
    if guess is None:
        raise TrackError(f"{NO_CONTACT} and no support is seen: give pivot=(u, v) in pixels")
    return camera(complex(state.look.lens.plane(guess)), CLOSE_ENOUGH * 1e-3, "support")


def meta_of(
    film: Film,
    tracks: Tracks,
    state: TrackerState,
    camera: Camera,
    options: TrackOptions,
    doubtful: int,
    turned: Wobble,
) -> dict[str, Any]:
    """Return the header of the measurement."""
    missing = max(0, film.promised - len(tracks))
    if missing or film.broken:
        warnings.warn(
            f"{film.path}: {missing or film.broken} frames are missing or do not decode; "
            "the film may be cut off",
            stacklevel=outside(),
        )
    look = state.look
    middle = (middle_of(state.view.shape) - camera.pivot) / camera.scale
    return {
        "source": film.path.name,
        "R": options.disk_radius,
        "fps": film.fps,
        **film.clock_meta,
        "frames": len(tracks),
        "frames_missing": missing,
        "frames_lost": sum(flag != "" for flag in tracks.flag),
        "turns_doubtful": doubtful,
        "exposure": state.exposure,
        "readout": state.estimates["readout"].value,
        "readout_sigma": state.estimates["readout"].sigma,
        "px_per_m": camera.scale,
        "px_per_m_sigma": camera.scale_sigma,
        "px_per_m_from": camera.scale_from,
        "pivot_u": camera.pivot.real,
        "pivot_v": camera.pivot.imag,
        "pivot_sigma": camera.pivot_sigma,
        "pivot_from": camera.pivot_from,
        "middle": [float(middle.real), float(-middle.imag)],
        "drive_seen": float(camera.drive.imag),
        "drive_lean": float(np.arctan2(camera.drive.real, camera.drive.imag)),
        "marks_px": [[m.place.real, m.place.imag] for m in look.marks],
        "marks_rgb": [list(c) for c in options.layout.colours],
        "psf_px": look.psf,
        "lens": _numbers(look.lens),
        "wobble": turned.amplitude if math.isfinite(turned.least) else None,
        "wobble_sigma": turned.sigma if math.isfinite(turned.least) else None,
        "wobble_axis": turned.axis,
        "calibration": table(estimates(tracks, state, camera, options, turned)),
    }


def _numbers(lens: Lens) -> list[float]:
    return [] if lens.plain else list(lens.row)


def estimates(
    tracks: Tracks, state: TrackerState, camera: Camera, options: TrackOptions, turned: Wobble
) -> dict[str, Estimate]:
    """Return the value, the standard error and the origin of every item.

    Lengths are in m, times in s, the contact in pixels of the picture, other items without unit. `how` is
    "found", "none found" (0 fits as well), "given" (also if it was switched off), or names the source.
    """
    out = dict(state.estimates)
    fixed = not options.calibrate.layout
    for k, (place, sigma) in enumerate(zip(state.look.places, places_sigma(tracks), strict=True), 1):
        at = place / camera.scale
        error = 0.0 if fixed else float(sigma / camera.scale)
        out[f"mark {k}"] = Estimate([float(at.real), float(-at.imag)], error, "given" if fixed else "found")
    out["scale"] = Estimate(camera.scale, camera.scale_sigma, camera.scale_from)
    at = complex(state.look.lens.picture(camera.pivot))
    out["pivot"] = Estimate([at.real, at.imag], camera.pivot_sigma * camera.scale, camera.pivot_from)
    out["W"] = Estimate(camera.drive.imag, camera.drive_sigma, "rolling constraint")
    out["wobble"] = turned.estimate
    return out


def places_sigma(tracks: Tracks) -> NDArray[np.float64]:
    """Standard error of each mark's place [pixels]: how its mean misfit differs between parts of the film."""
    left, angle = tracks.residuals, tracks.angle
    turned = (left[..., 0] + 1j * left[..., 1]) * np.exp(-1j * angle)[:, None]
    out = np.full(left.shape[1], np.nan)
    for k in range(left.shape[1]):
        seen = turned[np.isfinite(turned[:, k]), k]
        if len(seen) < 2 * BLOCKS:
            continue
        means = np.array([part.mean() for part in np.array_split(seen, BLOCKS)])
        out[k] = np.sqrt(np.mean(np.abs(means - means.mean()) ** 2) / 2 / (BLOCKS - 1))
    return out
