"""Marks in the colours and places of a layout, matched to blobs that were seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import SLACK, Layout, same_colour, similarity
from udd.video.reader import Picture

from .colour_blobs import LEAST_CHROMA, Blobs, Sight, agreeing, blobs
from .still_patches import split

HUE = 0.87  # the same between a pixel and its mark
SMALLEST, LARGEST = 0.015, 0.6  # side of a mark against the marks' reach
MOST = 40  # ways to see the disk in one picture that are kept


def sightings(
    pictures: Sequence[Picture], layout: Layout, scale: float | None = None, still: bool | None = None
) -> list[Sight | None]:
    """Find the disk in each picture that shows all its marks (or, of four and more, all but one).

    `scale` [pixels per metre] helps if little else distinguishes marks from patches of the same colours.
    `still`: use only patches at rest, or only moving ones; if not given, moving ones, else all.
    """
    patches = [coloured(p, layout) for p in pictures]
    chosen = [split(patches, bool(still)), *([patches] if still is None else [])]
    n = len(layout.places)
    best: list[Sight | None] = [None] * len(pictures)
    for chosen_patches in chosen:
        for least in range(n, max(n - 2, min(n, 3) - 1), -1):
            sights = agreeing([matches(p, layout, least, scale) for p in chosen_patches])
            if sum(s is not None for s in sights) > 2 * sum(s is not None for s in best):
                best = sights
            if sum(s is not None for s in best) >= max(3, len(pictures) // 10):
                return best
    return best


def coloured(picture: Picture, layout: Layout) -> list[Blobs]:
    """Blobs of each mark's colour; marks of one colour have the same ones."""
    u, v = picture.u.astype(np.float32) - 128, picture.v.astype(np.float32) - 128
    unit = (layout.chroma / np.hypot(*layout.chroma.T)[:, None]).astype(np.float32)
    along = np.stack([a * u + b * v for a, b in unit])
    size, best = np.hypot(u, v), along.max(axis=0)
    least = max(6, picture.u.size // 20000)
    strong = (size > LEAST_CHROMA) & (best > HUE * size)
    return [blobs(strong & (one >= best - 1e-3), least) for one in _merged(along, layout)]


def _merged(along: NDArray[np.float32], layout: Layout) -> list[NDArray[np.float32]]:
    """Return the component of each pixel along each mark's colour, or that of any mark with this colour."""
    return [along[row].max(axis=0) for row in same_colour(layout.chroma)]


def matches(
    patches: list[Blobs], layout: Layout, least: int, scale: float | None = None
) -> list[tuple[float, Sight]]:
    """Ways in which blobs could be the marks of the disk, as (misfit, sight), the best first."""
    body, n = layout.unit, len(layout.places)
    sights: list[tuple[int, float, Sight]] = []
    for i in range(n):
        for j in range(i + 1, n):
            for a in patches[i].centre:
                for b in patches[j].centre:
                    if abs(b - a) < 4:
                        continue
                    turn = (b - a) / (body[j] - body[i])
                    size = abs(turn) / layout.reach
                    if scale is None or abs(np.log(size / scale)) < SLACK:
                        match = _match(patches, body, complex(a - turn * body[i]), complex(turn))
                        if match is not None and match[0] >= least:
                            sights.append(match)
    sights.sort(key=lambda m: (-m[0], m[1]))
    return [(misfit, sight) for _, misfit, sight in sights[:MOST]]


def _match(
    patches: list[Blobs], body: NDArray[np.complex128], centre: complex, turn: complex
) -> tuple[int, float, Sight] | None:
    """Fit a rigid body, at any scale, to all blobs near the places that two of them predict."""
    at, seen, areas = [], [], []
    for k, patch in enumerate(patches):
        if len(patch.centre):
            away = np.abs(patch.centre - centre - turn * body[k])
            m = int(np.argmin(away))
            if away[m] < SLACK * abs(turn):
                at.append(body[k])
                seen.append(patch.centre[m])
                areas.append(patch.area[m])
    z, w, area = np.array(at), np.array(seen), np.array(areas)
    if len(w) < 2 or np.abs(w[:, None] - w[None, :])[~np.eye(len(w), dtype=bool)].min() < 4:
        return None  # one patch for two marks
    centre, turn = similarity(z, w)
    side = np.sqrt(area) / abs(turn)
    if side.max() > LARGEST or side.min() < SMALLEST or area.max() > 6 * area.min():
        return None
    misfit = float(np.sqrt(np.mean(np.abs(w - centre - turn * z) ** 2)) / abs(turn))
    return len(w), misfit, Sight(centre, float(np.angle(turn)), abs(turn), float(area.mean()))
