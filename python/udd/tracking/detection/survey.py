"""A look over the whole film before tracking: short bursts of frames, evenly spread."""

from __future__ import annotations

import cmath
import warnings
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from udd.errors import outside
from udd.video.frame_conversion import Samples
from udd.video.reader import Film, Picture, TrackError

from .colour_blobs import Sight

BURST = 3  # consecutive frames: the middle one has a speed, hence a known blur
BURSTS = 60
MEMORY = 2e8  # bytes of pictures kept, whatever the length of the film
FEWEST = 10
NEW = 0.15  # of the marks' reach: what counts as another pose


@dataclass(frozen=True)
class Survey:
    """Bursts of consecutive pictures, and what the run through the film found."""

    bursts: list[list[Picture]]
    frames: int
    broken: int
    height: int
    width: int

    @property
    def pictures(self) -> list[Picture]:
        """All of them, in order."""
        return [p for burst in self.bursts for p in burst]


def survey(film: Film) -> Survey:
    """Decode `film` once, keeping at most `MEMORY` bytes of it.

    If a converter changed the frame rate, the film yields the frames of the camera from here on.

    Raises
    ------
    TrackError
        No frame decodes, or fewer than 10.
    """
    bursts: list[list[Picture]] = []
    stride, most, frames = 1, BURSTS, 0
    height = width = 0
    samples = Samples(film.packets)
    for picture in film.pictures():
        number, place = divmod(frames, BURST)
        frames += 1
        if frames == 1:
            height, width = picture.y.shape
            size = picture.y.nbytes + picture.u.nbytes + picture.v.nbytes
            most = max(8, min(BURSTS, int(MEMORY / (BURST * size))))
        if picture.y.shape != (height, width):
            raise TrackError(f"{film.path}: the picture changes its size at frame {picture.index}")
        if film.conversion is None:
            samples.add(picture.y)
        if number % stride or picture.damaged:
            continue
        if place == 0 or not bursts:
            if len(bursts) == 2 * most:  # too many: keep every second one, and look half as often from here
                bursts = bursts[::2]
                stride *= 2
                if number % stride:
                    continue
            bursts.append([])
        bursts[-1].append(picture)
    if frames == 0:
        raise TrackError(f"{film.path}: no frame can be decoded")
    if frames < FEWEST:
        raise TrackError(f"{film.path} is too short: {frames} frames, at least {FEWEST} are needed")
    if not bursts:
        raise TrackError(f"{film.path}: no frame is left: each one is damaged or left out")
    film.conversion = film.conversion or samples.conversion()
    if film.conversion is not None and samples.rows:
        warnings.warn(f"{film.path}: {film.conversion.text}", stacklevel=outside())
        missing, converted = max(0, film.promised - frames), survey(film)
        film.promised = converted.frames + missing
        return converted
    step = -(-len(bursts) // most)
    return Survey([b for b in bursts[::step] if b], frames, film.broken, height, width)


def slowest(bursts: list[list[Picture]], sights: list[Sight | None]) -> list[tuple[Picture, Sight]]:
    """Pictures in which the disk was found, those with the least motion first, repeats last."""
    rows: list[tuple[float, Picture, Sight]] = []
    at = iter(sights)
    for burst in bursts:
        here = [next(at) for _ in burst]
        for k, (picture, sight) in enumerate(zip(burst, here, strict=True)):
            if sight is None:
                continue
            moves = []
            for j in (k - 1, k + 1):
                other = here[j] if 0 <= j < len(burst) else None
                if other is not None:
                    moves.append(_distance(sight, other))
            rows.append((float(np.mean(moves)) if moves else np.inf, picture, sight))
    ordered = sorted(rows, key=lambda item: item[0])
    return [(p, s) for _, p, s in repeats_last(ordered, [s for *_, s in ordered])]


def repeats_last(items: list[Any], sights: list[Sight]) -> list[Any]:
    """Sort the items so that those that show the disk almost as an earlier one does come last."""
    first: list[int] = []
    again: list[int] = []
    for k, sight in enumerate(sights):
        # a disk at rest teaches nothing new
        repeated = any(_distance(sight, sights[j]) < NEW * sight.reach for j in first)
        (again if repeated else first).append(k)
    return [items[k] for k in first + again]


def _distance(a: Sight, b: Sight) -> float:
    turn = abs(cmath.phase(cmath.exp(1j * (a.angle - b.angle))))  # numpy takes ten times as long
    return float(abs(a.centre - b.centre) + turn * a.reach)


@dataclass(frozen=True)
class Moving:
    """A disk found in a survey frame and in its neighbours: its pose and how fast it moves."""

    picture: Picture
    sight: Sight
    rate: complex  # pixels/s
    turning: float  # rad/s
    interval: float  # between frames [s]
    step: tuple[complex, complex, float, float]  # centre before, after [pixels], turn [rad], time [s]


def moving(bursts: list[list[Picture]], sights: list[Sight | None]) -> list[Moving]:
    """Pictures in which the disk was found, as it was in one next to it or more."""
    rows = []
    at = iter(sights)
    for burst in bursts:
        here = [(p, s) for p, s in zip(burst, [next(at) for _ in burst], strict=True) if s is not None]
        for k, (picture, sight) in enumerate(here):
            rates = []
            for (p0, s0), (p1, s1) in pairwise(here[max(0, k - 1) : k + 2]):
                if p1.index == p0.index + 1:
                    turn = float(np.angle(np.exp(1j * (s1.angle - s0.angle)) + 0j))
                    rates.append((s0.centre, s1.centre, turn, p1.t - p0.t))
            if rates:
                time = sum(r[3] for r in rates)
                rate, turn = sum(r[1] - r[0] for r in rates) / time, sum(r[2] for r in rates)
                rate /= np.sinc(turn / (2 * np.pi))  # a turning disk goes along an arc, longer than its chord
                turning = turn / time
                rows.append(Moving(picture, sight, rate, turning, time / len(rates), rates[-1]))
    return rows
