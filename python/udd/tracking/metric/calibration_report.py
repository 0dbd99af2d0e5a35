"""What the film said of its camera and of the device: the camera that places are told by, and a table."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.tracking.calibration.scale import Scale
from udd.tracking.calibration.setup import Setup
from udd.tracking.geometry.contact_point import pivot as rolling
from udd.tracking.geometry.contact_point import support
from udd.tracking.geometry.lens import Lens, middle_of
from udd.tracking.passes.first_pass import TrackerState, Tracks
from udd.tracking.passes.wobble import Wobble
from udd.video.reader import Film, TrackError

from .pixels_to_metres import Camera

CLOSE_ENOUGH = 6.0  # mm: how well the support alone tells where the contact is
BLOCKS = 20  # stretches of the film whose means are the independent pieces
MINOR = 0.1  # share of what is said below which the film alone is named
APART = 5.0  # standard errors between what is said and what is found, beyond which one of them is wrong


def camera_of(tracks: Tracks, known: TrackerState, size: Scale, setup: Setup) -> Camera:
    """Scale and contact point, from the rolling constraint, by hand, or at worst from the support.

    A contact that is said with an error counts by it beside the rolling constraint's own.

    Raises
    ------
    TrackError
        Neither the motion nor a support tells where the contact is, and nobody said it.
    """
    angle, centre = np.array(tracks.angle), np.array(tracks.centre)
    good = np.isfinite(angle)
    found = rolling(np.array(tracks.t), centre, angle, good, known.look.reach)
    drive, drive_sigma = complex(np.nan, np.nan), np.nan
    if found is not None:
        drive = complex(np.conj(found.drive) / size.value)
        drive_sigma = float(np.hypot(found.drive_sigma / size.value, abs(drive) * size.sigma / size.value))

    def camera(place: complex, sigma: float, origin: str) -> Camera:
        return Camera(size.value, size.sigma, size.origin, place, sigma, origin, drive, drive_sigma)

    if setup.pivot is not None:
        place = complex(float(setup.pivot[0]), float(setup.pivot[1]))
        if not np.isfinite(place):
            raise TrackError(f"pivot must be two finite numbers, not {setup.pivot!r}")
        place, said = complex(known.look.lens.plane(place)), setup.sigma.pivot
        if found is None or not said or not setup.calibrate.pivot:
            return camera(place, said / size.value, "given")
        of_film = float(found.covariance[0, 0])
        if abs(found.place - place) < APART * np.hypot(said, np.sqrt(of_film)):
            share = of_film / (of_film + said**2)  # of what is said
            sigma = float(np.sqrt(share) * said) / size.value
            how = "rolling constraint" if share < MINOR else "rolling constraint and given"
            return camera(found.place + share * (place - found.place), sigma, how)
        warnings.warn(
            f"the disk turns about a point {abs(found.place - place):.0f} pixels from the pivot that is "
            "given; the motion is believed",
            stacklevel=5,
        )
    if found is not None:
        return camera(found.place, float(np.sqrt(found.covariance[0, 0])) / size.value, "rolling constraint")
    guess = support(known.view)
    if guess is None:
        raise TrackError(
            "the motion does not tell where the contact point is (the disk hardly turns, or turns steadily) "
            "and no support is seen: give pivot=(u, v) in pixels"
        )
    warnings.warn(
        "the motion does not tell where the contact point is; it is taken from the support, to about "
        f"{CLOSE_ENOUGH:.0f} mm",
        stacklevel=5,
    )
    return camera(complex(known.look.lens.plane(guess)), CLOSE_ENOUGH * 1e-3, "support")


def meta_of(
    film: Film,
    tracks: Tracks,
    known: TrackerState,
    camera: Camera,
    setup: Setup,
    doubtful: int,
    turned: Wobble,
) -> dict[str, Any]:
    """The header of the measurement."""
    missing = max(0, film.promised - len(tracks.t))
    if missing or film.broken:
        warnings.warn(
            f"{film.path}: {missing or film.broken} frames are missing or do not decode; "
            "the film may be cut off",
            stacklevel=5,
        )
    look = known.look
    middle = (middle_of(known.view.shape) - camera.pivot) / camera.scale
    return {
        "source": film.path.name,
        "R": setup.radius,
        "fps": film.fps,
        "frames": len(tracks.t),
        "frames_missing": missing,
        "frames_lost": sum(flag != "" for flag in tracks.flag),
        "turns_doubtful": doubtful,
        "exposure": known.exposure,
        "readout": known.readout.value,
        "readout_sigma": known.readout.sigma,
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
        "marks_rgb": [list(c) for c in setup.layout.colours],
        "psf_px": look.psf,
        "lens": _numbers(look.lens),
        "wobble": turned.amplitude if math.isfinite(turned.least) else None,
        "wobble_sigma": turned.sigma if math.isfinite(turned.least) else None,
        "wobble_axis": turned.axis,
        "calibration": table(tracks, known, camera, setup) | {"wobble": _wobble(turned)},
    }


def _numbers(lens: Lens) -> list[float]:
    return [] if lens.plain else list(lens.row)


def table(tracks: Tracks, known: TrackerState, camera: Camera, setup: Setup) -> dict[str, list[Any]]:
    """Every item of the self-calibration as [value, standard error, how]; None: not known.

    Lengths in m, times in s, the contact in pixels of the picture, the rest bare numbers; `how` is "found",
    "none found" (0 is as good), "given" (also where it was switched off), or says from what.
    """
    wanted, lens = setup.calibrate, known.look.lens
    bent = np.zeros(5) if known.bent is None else known.bent.sigma
    lens_how = "found" if known.bent is not None and known.bent.found else "none found"

    def how(name: str, found: str) -> str:
        return found if wanted.given(name) is None else "given"

    out: dict[str, list[Any]] = {}
    for k, (place, sigma) in enumerate(zip(known.look.places, places_sigma(tracks, known), strict=True), 1):
        at = place / camera.scale
        said = [[float(at.real), float(-at.imag)], sigma / camera.scale, how("layout", "found")]
        out[f"mark {k}"] = [said[0], 0.0 if said[2] == "given" else said[1], said[2]]
    out["scale"] = [camera.scale, camera.scale_sigma, camera.scale_from]
    out["lens"] = [lens.curve, bent[0], how("lens", lens_how)]
    names = ("tilt across", "tilt upward", "aspect", "shear")
    values = (lens.tilt_u, lens.tilt_v, lens.aspect, lens.shear)
    for name, value, sigma in zip(names, values, bent[1:], strict=True):
        out[name] = [value, sigma, how("tilt", lens_how)]
    rolling_how = "found" if known.readout.value else "none found"
    out["readout"] = [known.readout.value, known.readout.sigma, how("readout", rolling_how)]
    shut = "found" if known.exposure or math.isfinite(known.exposure_sigma) else "too slow to tell"
    out["exposure"] = [known.exposure, known.exposure_sigma, how("exposure", shut)]
    at = complex(lens.picture(camera.pivot))
    out["pivot"] = [[at.real, at.imag], camera.pivot_sigma * camera.scale, camera.pivot_from]
    out["W"] = [camera.drive.imag, camera.drive_sigma, "rolling constraint"]
    return {name: [_plain(value), _plain(sigma), how] for name, (value, sigma, how) in out.items()}


def _wobble(found: Wobble) -> list[Any]:
    if not math.isfinite(found.least):
        return [None, None, "too few marks to tell"]
    how = "found" if found.amplitude else f"none seen (less than {math.degrees(found.least):.1f} degrees)"
    return [found.amplitude, found.sigma, how]


def _plain(value: Any) -> Any:
    """Numbers as they are, None for what is not finite."""
    if isinstance(value, list):
        return [_plain(v) for v in value]
    return float(value) if math.isfinite(value) else None


def places_sigma(tracks: Tracks, known: TrackerState) -> NDArray[np.float64]:
    """Standard error of each mark's place [pixels]: how its mean misfit differs between parts of the film."""
    left, angle = np.array(tracks.leftover), np.array(tracks.angle)
    turned = (left[..., 0] + 1j * left[..., 1]) * np.exp(-1j * angle)[:, None]
    out = np.full(left.shape[1], np.nan)
    for k in range(left.shape[1]):
        seen = turned[np.isfinite(turned[:, k]), k]
        if len(seen) < 2 * BLOCKS:
            continue
        means = np.array([part.mean() for part in np.array_split(seen, BLOCKS)])
        out[k] = np.sqrt(np.mean(np.abs(means - means.mean()) ** 2) / 2 / (BLOCKS - 1))
    return out
