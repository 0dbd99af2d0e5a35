"""A look over the whole film before tracking: short bursts of frames, evenly spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .decode import Film, Picture, TrackError
from .find import Sight

BURST = 3  # consecutive frames: the middle one has a speed, hence a known blur
BURSTS = 60
MEMORY = 2e8  # bytes of pictures kept, whatever the length of the film
FEWEST = 10


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
        return [p for burst in self.bursts for p in burst]


def survey(film: Film) -> Survey:
    """Decode `film` once, keeping at most `MEMORY` bytes of it.

    Raises
    ------
    TrackError
        No frame decodes, or fewer than 10.
    """
    bursts: list[list[Picture]] = []
    stride, most, frames = 1, BURSTS, 0
    height = width = 0
    for picture in film.pictures():
        number, place = divmod(frames, BURST)
        frames += 1
        if frames == 1:
            height, width = picture.y.shape
            size = picture.y.nbytes + picture.u.nbytes + picture.v.nbytes
            most = max(8, min(BURSTS, int(MEMORY / (BURST * size))))
        if picture.y.shape != (height, width):
            raise TrackError(f"{film.path}: the picture changes its size at frame {picture.index}")
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
    step = max(1, len(bursts) // most)
    return Survey([b for b in bursts[::step] if b], frames, film.broken, height, width)


def slowest(bursts: list[list[Picture]], sights: list[Sight | None]) -> list[tuple[Picture, Sight]]:
    """Pictures in which the disk was found, those with the least motion to a neighbour first, repeats last."""
    found: list[tuple[float, Picture, Sight]] = []
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
                    moves.append(_apart(sight, other))
            found.append((float(np.mean(moves)) if moves else np.inf, picture, sight))
    first: list[tuple[Picture, Sight]] = []
    again: list[tuple[Picture, Sight]] = []
    for _, picture, sight in sorted(found, key=lambda item: item[0]):
        # a disk at rest teaches nothing new
        known = any(abs(_apart(sight, s)) < 2.0 for _, s in first)
        (again if known else first).append((picture, sight))
    return first + again


def _apart(a: Sight, b: Sight) -> float:
    turn = abs(np.angle(np.exp(1j * (a.angle - b.angle))))
    return float(abs(a.centre - b.centre) + turn * a.reach)
