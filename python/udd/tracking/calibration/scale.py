"""Scale in pixels per metre, from the spacing of the marks and from the rim."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.errors import outside
from udd.tracking.options import TrackOptions

from .rim import Rim

REACH = 65 / 80  # of the radius: where the marks of the standard disk have their centres
RIM_EDGE = 0.35  # pixels: how well light and lens let one say where a bright disk ends
DISAGREES = 5.0  # standard errors between a given and a fitted value beyond which one of them is wrong
MINOR = 0.1  # share of the given value below which the film alone is named
PLACED = 0.02  # pixels: how well the marks' mean places are known
BY_HAND = 0.05e-3  # m: how well two marks are glued where the layout says; three and more show it themselves
UNLIKE = 0.015  # relative difference from the rim's scale at which the marks are not the standard ones


@dataclass(frozen=True)
class Scale:
    """Pixels per metre, its standard error (a factor common to all positions), and what it comes from."""

    value: float
    sigma: float
    origin: str


def scale(places: NDArray[np.complex128], rim: Rim | None, options: TrackOptions) -> Scale:
    """Combine the marks' spacing, their distance from the disk's centre known, with the rim's radius.

    Each counts by its uncertainty: that of the rim is where its edge lies; that of the marks shows in how far
    they are from their layout. Without a given distance the standard marks count where they fit the standard
    disk. A scale that is said with an error counts by it, too. Two marks whose distance was measured say more
    than all that.
    """
    said = None if options.scale is None else Scale(options.scale, options.sigma.scale, "given")
    if said is not None and not (said.sigma and options.calibrate.scale):
        return said
    film = _from_film(places, rim, options)
    if said is None or film is None:
        return film or said or _by_marks(places, options)  # one is there
    if abs(film.value - said.value) < DISAGREES * np.hypot(film.sigma, said.sigma):
        return _combined(film, said)
    warnings.warn(
        f"the film shows {film.value:.1f} pixels per metre (by its {film.origin}), not the {said.value:.1f} "
        "that are given; the film is believed",
        stacklevel=outside(),
    )
    return film


def _by_rim(rim: Rim, options: TrackOptions) -> Scale:
    return Scale(
        rim.radius / options.disk_radius, float(np.hypot(rim.sigma, RIM_EDGE)) / options.disk_radius, "rim"
    )


def _combined(film: Scale, said: Scale) -> Scale:
    """Mean of what is found and what is said, each by its uncertainty."""
    share = film.sigma**2 / (film.sigma**2 + said.sigma**2)  # of what is said
    origin = film.origin if share < MINOR else f"{film.origin}, and given"
    return Scale(film.value + share * (said.value - film.value), float(np.sqrt(share)) * said.sigma, origin)


def _from_film(places: NDArray[np.complex128], rim: Rim | None, options: TrackOptions) -> Scale | None:
    """Estimate the scale from the film; None if the film adds nothing to the given values."""
    if options.apart is not None:
        one, other, distance = options.apart
        value = float(abs(places[one - 1] - places[other - 1])) / distance
        return Scale(
            value, float(np.hypot(1.4 * PLACED, BY_HAND * value)) / distance, "distance of two marks"
        )
    shown = None if rim is None else _by_rim(rim, options)
    if options.scale is not None and options.sigma.layout:
        return shown  # a layout that is known no better was measured with that scale: it is no other evidence
    marks = _by_marks(places, options)
    if shown is None:
        return marks
    if (
        options.layout.standard
        and options.mark_distance is None
        and abs(marks.value / shown.value - 1) > UNLIKE
    ):
        return shown
    w_rim, w_marks = shown.sigma**-2, marks.sigma**-2
    value = (w_rim * shown.value + w_marks * marks.value) / (w_rim + w_marks)
    origin = "marks and rim" if 0.1 < w_rim / w_marks < 10 else "marks" if w_marks > w_rim else "rim"
    return Scale(value, float((w_rim + w_marks) ** -0.5), origin)


def _by_marks(places: NDArray[np.complex128], options: TrackOptions) -> Scale:
    layout = options.layout
    reach = layout.reach if not layout.standard else options.mark_distance or REACH * options.disk_radius
    body = layout.unit * reach
    body = body - body.mean()
    away = places - places.mean()
    square = float(np.vdot(body, body).real)
    factor = complex(np.vdot(body, away)) / square
    rest = away - factor * body
    # of 2 n coordinates a shift, a turn and a factor take four
    spare = 2 * len(places) - 4
    value = abs(factor)
    glued = float(np.sqrt((np.abs(rest) ** 2).sum() / spare)) if spare else BY_HAND * value
    sigma = np.hypot(PLACED, options.sigma.layout * value)
    return Scale(value, float(np.hypot(glued, sigma) / np.sqrt(square)), "marks")
