"""Finding the disk without any hint: four coloured blobs at the corners of a square."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.markers.layout import BODY
from udd.video.reader import Picture

Complexes = NDArray[np.complex128]

COLOURS = ("red", "orange", "blue", "green")  # clockwise on the disk
# Hue in the plane of the colour differences (angle of U + iV, degrees) of paper and paint in these
# colours: from sRGB by BT.601; red and orange part at 122.
HUES = {"red": (80.0, 122.0), "orange": (122.0, 165.0), "blue": (-70.0, 15.0), "green": (195.0, 285.0)}
LEAST_CHROMA = 18.0  # of 127: below, grey with noise
FADED = 8.0  # the same where no strong colours are found
FEWEST = 3  # frames that must show the disk
WIDTH = 2  # half-resolution pixels: the margin of a patch that is looked at


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
def _names(least: float) -> NDArray[np.uint8]:
    """Number of the colour, 1 to 4 (0: none), for each pair of colour differences, (256, 256) by U and V."""
    difference = np.arange(256.0) - 128
    u, v = difference[:, None], difference[None, :]
    hue = np.degrees(np.arctan2(v, u)) % 360
    hue = np.where(hue > 285, hue - 360, hue)
    strong = np.hypot(u, v) > least
    names = np.zeros((256, 256), dtype=np.uint8)
    for k, colour in enumerate(COLOURS):
        names[strong & (hue > HUES[colour][0]) & (hue <= HUES[colour][1])] = k + 1
    return names


def blobs(
    mask: NDArray[np.bool_], least: int, most: int = 14, pale: NDArray[np.bool_] | None = None
) -> Blobs:
    """Connected patches of a half-resolution mask, the largest first, and at most so many.

    If there are more, those that `pale` pixels surround come first, as a disk surrounds its marks.
    """
    import cv2

    codes = mask.astype(np.uint8)
    column, row, width, height = cv2.boundingRect(codes)  # most of a picture has none of the colour
    if not width:
        return Blobs(np.empty(0, np.complex128), np.empty(0))
    part = codes[row : row + height, column : column + width]
    count, _, stats, centre = cv2.connectedComponentsWithStats(part, connectivity=8)
    area = stats[1:count, cv2.CC_STAT_AREA]
    order = np.argsort(-area, kind="stable")
    order = order[area[order] >= least]
    if pale is not None and len(order) > most:
        margin = _pale_margin(stats[1:count][order], pale[row : row + height, column : column + width])
        order = order[np.argsort(-np.round(margin, 1), kind="stable")]
    order = order[:most]
    xy = centre[1:count][order] + [column, row]
    # a half-resolution sample i covers the full pixels 2i and 2i + 1, whose middle is 2i + 1/2
    return Blobs(np.asarray(2 * (xy[:, 0] + 1j * xy[:, 1]) + (0.5 + 0.5j)), np.asarray(4.0 * area[order]))


def _pale_margin(boxes: NDArray[Any], pale: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the share of pale pixels in the margin of each box (left, top, width, height, area)."""
    import cv2

    sums = cv2.integral(pale.astype(np.uint8))
    left, top, right, bottom = boxes[:, 0], boxes[:, 1], boxes[:, 0] + boxes[:, 2], boxes[:, 1] + boxes[:, 3]

    def inside(by: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        x0, x1 = (np.clip(x, 0, pale.shape[1]) for x in (left - by, right + by))
        y0, y1 = (np.clip(y, 0, pale.shape[0]) for y in (top - by, bottom + by))
        counts = sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]
        return counts.astype(float), ((x1 - x0) * (y1 - y0)).astype(float)

    (outer, whole), (inner, part) = inside(WIDTH), inside(0)
    return np.asarray((outer - inner) / np.maximum(whole - part, 1))


def coloured(picture: Picture, chroma: float = LEAST_CHROMA) -> list[Blobs]:
    """Blobs of each of the four colours, by broad hues, stronger than `chroma`."""
    name = _names(chroma).ravel()[(picture.u.astype(np.uint16) << 8) | picture.v]
    least = max(6, picture.u.size // 20000)
    pale = name == 0
    return [blobs(name == k + 1, least, pale=pale) for k in range(len(COLOURS))]


def squares(
    patches: list[Blobs], without: int | None = None, slack: float = 0.12
) -> list[tuple[float, Sight]]:
    """Quadruples of blobs that could be the marks of one disk, as (misfit, sight).

    The two diagonals share their middle and their length and cross at a right angle, red, orange,
    blue, green clockwise; the areas are alike and small against the square. `without` one of the marks, half
    a diagonal has to do.
    """
    if without is not None:
        return _corners(patches, without, slack / 2)
    red, orange, blue, green = (b.centre for b in patches)
    if 0 in (len(red), len(orange), len(blue), len(green)):
        return []
    d1 = (red[:, None] - blue[None, :]).reshape(-1, 1)
    d2 = ((orange[:, None] - green[None, :]) / 1j).reshape(1, -1)
    m1 = ((red[:, None] + blue[None, :]) / 2).reshape(-1, 1)
    m2 = ((orange[:, None] + green[None, :]) / 2).reshape(1, -1)
    size = np.abs(d1) + 1e-9
    misfit = np.maximum(np.abs(m1 - m2) / size, np.abs(d1 - d2) / size)
    sights = []
    for i, j in np.argwhere(misfit < slack):
        a, c = divmod(int(i), len(blue))
        b, d = divmod(int(j), len(green))
        area = np.array([p.area[k] for p, k in zip(patches, (a, b, c, d), strict=True)])
        sight = _sight(complex(m1[i, 0] + m2[0, j]) / 2, complex(d1[i, 0] + d2[0, j]) / 4, 0, area)
        if sight is not None:
            sights.append((float(misfit[i, j]), sight))
    return sorted(sights, key=lambda item: item[0])


def _corners(patches: list[Blobs], without: int, slack: float) -> list[tuple[float, Sight]]:
    """Triples that could be three of the marks: a diagonal, and one mark where the other one crosses it."""
    single, first, second = (without + 2) % 4, (without + 1) % 4, (without + 3) % 4
    a, b, c = (patches[k].centre for k in (first, second, single))
    if 0 in (len(a), len(b), len(c)):
        return []
    middle = ((a[:, None] + b[None, :]) / 2).reshape(-1, 1)
    arm = ((a[:, None] - b[None, :]) / 2).reshape(-1, 1)
    # a quarter turn clockwise (in u + iv) leads from one mark to the next
    expected = middle + arm * 1j ** (single - first)
    misfit = np.abs(c[None, :] - expected) / (2 * np.abs(arm) + 1e-9)
    corners = []
    for i, k in np.argwhere(misfit < slack):
        p, q = divmod(int(i), len(b))
        area = np.array([patches[first].area[p], patches[second].area[q], patches[single].area[k]])
        sight = _sight(complex(middle[i, 0]), complex(arm[i, 0]), first, area)
        if sight is not None:
            corners.append((float(misfit[i, k]), sight))
    return sorted(corners, key=lambda item: item[0])


def _sight(centre: complex, arm: complex, mark: int, area: NDArray[np.float64]) -> Sight | None:
    """Return the disk with its centre and the arm to a mark, if the marks' areas fit."""
    ratio = np.sqrt(area) / (2 * abs(arm) + 1e-9)
    if area.max() > 4 * area.min() or ratio.max() > 0.4 or ratio.min() < 0.02:
        return None
    angle = float(np.angle(arm / BODY[mark]))
    return Sight(centre, angle, abs(arm), float(area.mean()))


def sightings(
    pictures: list[Picture], choose: Callable[[list[list[Blobs]]], list[list[Blobs]]] = lambda every: every
) -> tuple[list[Sight | None], int | None]:
    """Find the disk in each picture, None if its marks are not recognised; and the mark that is missing.

    Strong colours are looked for first, then faded ones, then three marks instead of four. `choose` picks the
    patches that may be marks.
    """
    best: tuple[list[Sight | None], int | None] = ([None] * len(pictures), None)
    for chroma in (LEAST_CHROMA, FADED):
        patches = choose([coloured(p, chroma) for p in pictures])
        for without in (None, 0, 1, 2, 3):
            sights = agreeing([squares(p, without) for p in patches])
            if _count(sights) > (1 if without is None else 2) * max(_count(best[0]), FEWEST - 1):
                best = sights, without
            if _count(best[0]) >= max(FEWEST, len(pictures) // 10):
                return best
    return best


def _count(sights: list[Sight | None]) -> int:
    return sum(s is not None for s in sights)


def agreeing(everything: list[list[tuple[float, Sight]]]) -> list[Sight | None]:
    """One sight a picture, of the size that most agree on: the camera stands still."""
    reaches = np.array([s.reach for sights in everything for _, s in sights[:20]])
    weight = np.array([1 / (0.01 + misfit) for sights in everything for misfit, _ in sights[:20]])
    if not len(reaches):
        return [None] * len(everything)
    like = np.abs(np.log(reaches[:, None] / reaches[None, :])) < 0.03
    reach = float(reaches[np.argmax(like @ weight)])
    return [
        next((s for _, s in sights if abs(np.log(s.reach / reach)) < 0.04), None) for sights in everything
    ]
