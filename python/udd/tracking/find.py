"""Finding the disk without any hint: four coloured blobs at the corners of a square."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .decode import Picture

Complexes = NDArray[np.complex128]

COLOURS = ("red", "orange", "blue", "green")  # clockwise on the disk
# Hue in the plane of the colour differences (angle of U + iV, degrees) of paper and paint in these
# colours: from sRGB by BT.601; red and orange part at 122.
HUES = {"red": (80.0, 122.0), "orange": (122.0, 165.0), "blue": (-70.0, 15.0), "green": (195.0, 285.0)}
BODY = np.array([-1j, 1, 1j, -1])  # directions of the marks in the body frame; picture points are u + iv
LEAST_CHROMA = 18.0  # of 127: below, grey with noise


@dataclass(frozen=True)
class Blobs:
    """Coloured patches: centres (u + iv, pixels of the full picture) and areas (full pixels)."""

    centre: Complexes
    area: NDArray[np.float64]


@dataclass(frozen=True)
class Sight:
    """A disk seen in a survey frame."""

    centre: complex  # pixels
    angle: float  # beta [rad], not unwrapped
    reach: float  # distance of the marks from the centre [pixels]
    area: float  # mean area of a mark [pixels]


@cache
def _names() -> NDArray[np.uint8]:
    """Number of the colour, 1 to 4 (0: none), for each pair of colour differences, (256, 256) by U and V."""
    difference = np.arange(256.0) - 128
    u, v = difference[:, None], difference[None, :]
    hue = np.degrees(np.arctan2(v, u)) % 360
    hue = np.where(hue > 285, hue - 360, hue)
    strong = np.hypot(u, v) > LEAST_CHROMA
    names = np.zeros((256, 256), dtype=np.uint8)
    for k, colour in enumerate(COLOURS):
        names[strong & (hue > HUES[colour][0]) & (hue <= HUES[colour][1])] = k + 1
    return names


def blobs(mask: NDArray[np.bool_], least: int, most: int = 14) -> Blobs:
    """Connected patches of a half-resolution mask, the largest first."""
    import cv2

    count, _, stats, centre = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    area = stats[1:count, cv2.CC_STAT_AREA]
    order = np.argsort(-area, kind="stable")[:most]
    order = order[area[order] >= least]
    xy = centre[1:count][order]
    # a half-resolution sample i covers the full pixels 2i and 2i + 1, whose middle is 2i + 1/2
    return Blobs(np.asarray(2 * (xy[:, 0] + 1j * xy[:, 1]) + (0.5 + 0.5j)), np.asarray(4.0 * area[order]))


def coloured(picture: Picture) -> list[Blobs]:
    """Blobs of each of the four colours, by broad hues."""
    name = _names().ravel()[(picture.u.astype(np.uint16) << 8) | picture.v]
    least = max(6, picture.u.size // 20000)
    return [blobs(name == k + 1, least) for k in range(len(COLOURS))]


def squares(patches: list[Blobs], slack: float = 0.12) -> list[tuple[float, Sight]]:
    """Quadruples of blobs that could be the marks of one disk, as (misfit, sight).

    The two diagonals share their middle and their length and cross at a right angle, red, orange,
    blue, green clockwise; the areas are alike and small against the square.
    """
    red, orange, blue, green = (b.centre for b in patches)
    if 0 in (len(red), len(orange), len(blue), len(green)):
        return []
    d1 = (red[:, None] - blue[None, :]).reshape(-1, 1)
    d2 = ((orange[:, None] - green[None, :]) / 1j).reshape(1, -1)
    m1 = ((red[:, None] + blue[None, :]) / 2).reshape(-1, 1)
    m2 = ((orange[:, None] + green[None, :]) / 2).reshape(1, -1)
    size = np.abs(d1) + 1e-9
    misfit = np.maximum(np.abs(m1 - m2) / size, np.abs(d1 - d2) / size)
    found = []
    for i, j in np.argwhere(misfit < slack):
        a, c = divmod(int(i), len(blue))
        b, d = divmod(int(j), len(green))
        area = np.array([p.area[k] for p, k in zip(patches, (a, b, c, d), strict=True)])
        diagonal = complex(d1[i, 0] + d2[0, j]) / 2
        ratio = np.sqrt(area) / abs(diagonal)
        if area.max() > 4 * area.min() or ratio.max() > 0.4 or ratio.min() < 0.02:
            continue
        angle = float(np.angle(diagonal / (BODY[0] - BODY[2])))
        centre = complex(m1[i, 0] + m2[0, j]) / 2
        found.append((float(misfit[i, j]), Sight(centre, angle, abs(diagonal) / 2, float(area.mean()))))
    return sorted(found, key=lambda item: item[0])


def sightings(pictures: list[Picture]) -> list[Sight | None]:
    """The disk in each picture where all four marks can be told, None elsewhere.

    The camera stands still, so the square has one size over the whole film: the size found most
    often decides between quadruples.
    """
    everything = [squares(coloured(p)) for p in pictures]
    reaches = np.array([s.reach for found in everything for _, s in found[:20]])
    weight = np.array([1 / (0.01 + misfit) for found in everything for misfit, _ in found[:20]])
    if not len(reaches):
        return [None] * len(pictures)
    near = np.abs(np.log(reaches[:, None] / reaches[None, :])) < 0.03
    reach = float(reaches[np.argmax(near @ weight)])
    return [next((s for _, s in found if abs(np.log(s.reach / reach)) < 0.04), None) for found in everything]
