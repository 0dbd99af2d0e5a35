"""The bob of a pendulum in one picture: a patch of one colour, grey ones too, that the background lacks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.video.reader import Film, Picture, TrackError
from udd.video.rgb_frames import rgb
from udd.video.srgb import light_of

from .colour_blobs import Blobs, blobs

Array = NDArray[np.float64]
Box = tuple[int, int, int, int]  # rows from, to, columns from, to [pixels]
STRONG = 14.0  # of 127: how much more of its colour than the background a bob has
SMALL = 12  # pixels of colour that are no bob
SHARE = 0.4  # of its colour and light from which on a pixel counts as the bob's
COLOURFUL = 40.0  # of 127: chroma from which on colour alone distinguishes a bob; brightness helps below
CONTRAST = 18.0  # codes by which a pale bob must differ from the background
ALIKE = 0.5  # of the change toward a pale bob's colour by which a pixel may change otherwise
HUE, BRIGHTNESS = 2.0, 0.5  # weights of differences: lamps change the brightness of a colour, not its hue
MOST_OTHER = 70.0  # weighted codes by which a pale bob may differ from the colour that was given
THIN = 0.5  # of the radius of a pale bob: thinner parts, as a rod, do not belong to it
FEWEST = 5  # pictures of the survey that must show the bob
UNSEEN = "the bob is not seen"
HALF_HIDDEN = 0.93  # share of the size in the last frames below which the middle is not the bob's
TOO_MUCH = 1.15  # and above which something else of its colour is there
LEAST, MOST = 0.87, 1.2  # the same of the size in the whole film
WITHIN, WIDEST = 3.0, 0.35  # standard deviations that an area may be off, and a relative difference at most


@dataclass(frozen=True)
class Blob:
    """The bob in one picture: middle, size and second moments [pixels]."""

    centre: complex
    area: float
    moments: Array  # (2, 2)


@dataclass(frozen=True)
class BobColour:
    """A bob's colour.

    Attributes
    ----------
    chroma : ndarray (2,)
        Colour differences U and V, of 127.
    code : ndarray (3,)
        Y, U - 128 and V - 128 as the film shows them.
    """

    chroma: Array
    code: Array

    @classmethod
    def of(cls, rgb: Sequence[int], chroma: Array, full_range: bool) -> BobColour:
        """Make it from sRGB codes."""
        light = float(np.dot((0.299, 0.587, 0.114), rgb))
        return cls(chroma, np.array([light if full_range else 16 + light * 219 / 255, *chroma]))

    @property
    def pale(self) -> bool:
        """True if the bob is so pale that brightness must help to distinguish it."""
        return float(np.hypot(*self.chroma)) < COLOURFUL


@dataclass(frozen=True)
class Background:
    """The part of the pictures at rest, and the region of the bob."""

    picture: Picture
    grain: float  # of the pictures about it [codes]
    inside: NDArray[np.bool_]  # (height / 2, width / 2): the region
    full_range: bool

    @classmethod
    def of(cls, some: Sequence[Picture], inside: NDArray[np.bool_], full_range: bool) -> Background:
        """Make it from pictures all over the film: their median; `inside` is at full resolution."""
        planes = [np.stack([getattr(p, name) for p in some]) for name in ("y", "u", "v")]
        middle = [np.median(x, axis=0).astype(np.uint8) for x in planes]
        grain = np.abs(planes[0][:, ::4, ::4].astype(np.int16) - middle[0][::4, ::4])
        rows, columns = middle[1].shape
        return cls(
            Picture(0, 0.0, *middle),
            float(1.48 * np.median(grain[grain > 0])) if (grain > 0).any() else 1.0,
            inside[::2, ::2][:rows, :columns],
            full_range,
        )

    def change(self, picture: Picture) -> NDArray[np.float32]:
        """Return how a picture differs from it in Y, U and V at half the resolution, (rows, columns, 3)."""
        return _codes(picture) - _codes(self.picture)


def bob_colour(film: Film, some: Sequence[Picture], behind: Background, colour: BobColour) -> BobColour:
    """Learn the colour of a pale bob from pictures of the film: lamps and cameras change it.

    Raises
    ------
    TrackError
        Nothing of about that colour moves in the film.
    """
    if not colour.pale:
        return colour
    seen = []
    for picture in some:
        codes, change = _codes(picture), behind.change(picture)
        moved = (np.abs(change).max(axis=2) > CONTRAST) & behind.inside
        off = np.where(moved, _difference(codes, colour.code), np.inf)
        best = _thickest(off < MOST_OTHER, SMALL // 4)
        if best is not None:
            seen.append(np.median(codes[best], axis=0))
    if len(seen) < FEWEST:
        raise TrackError(
            f"{film.path}: nothing of about the bob's colour moves in this film; {_moving(some, behind)}"
        )
    return BobColour(colour.chroma, np.median(np.array(seen), axis=0))


def _moving(some: Sequence[Picture], behind: Background) -> str:
    """Return the colour of what moves, as the end of a message."""
    seen = []
    for picture in some:
        moved = (np.abs(behind.change(picture)).max(axis=2) > CONTRAST) & behind.inside
        best = _thickest(moved, SMALL // 4)
        if best is not None:
            rows, columns = best.shape
            codes = rgb(picture, behind.full_range)[::2, ::2][:rows, :columns]
            seen.append(np.median(codes[best], axis=0))
    if len(seen) < FEWEST:
        return "nothing else moves in it either"
    said = ",".join(f"{code:.0f}" for code in np.median(np.array(seen), axis=0))
    return f"what moves has about the sRGB codes {said}: give these as bob if it is the bob"


@dataclass(frozen=True)
class UsualArea:
    """Usual area of a bob [pixels], and its relative scatter, which is large for small bobs."""

    size: float
    scatter: float

    def unlike(self, area: float, recent: Iterable[float | None]) -> str:
        """Return why a patch is no whole bob, or an empty text; light changes its size slowly."""
        seen = [a for a in recent if a is not None]
        usual = float(np.median(seen)) if seen else self.size
        spread = min(WITHIN * self.scatter, WIDEST)
        if area <= min(LEAST, 1 - spread) * self.size or area <= min(HALF_HIDDEN, 1 - spread) * usual:
            return "the bob looks too small: it is partly hidden, or blurred"
        if area >= max(MOST, 1 + spread) * self.size or area >= max(TOO_MUCH, 1 + spread) * usual:
            return "the bob looks too large: it is blurred, or touches something of its colour"
        return ""


def usual_area(film: Film, some: Sequence[Picture], behind: Background, colour: BobColour) -> UsualArea:
    """Return the bob's usual area and its scatter.

    Raises
    ------
    TrackError
        No bob of that colour moves in the film.
    """
    areas = [seen[0].area for seen in (locate_bobs(p, behind, colour) for p in some) if seen]
    if len(areas) < FEWEST:
        raise TrackError(f"{film.path}: no bob of that colour moves in this film; {_moving(some, behind)}")
    size = float(np.median(areas))
    return UsualArea(size, 1.48 * float(np.median(np.abs(np.array(areas) / size - 1))))


def locate_bobs(picture: Picture, behind: Background, colour: BobColour) -> list[Blob]:
    """Return the patches of the colour, the largest first; something else may have it, too."""
    excess = _pale_excess(picture, behind, colour) if colour.pale else _excess(picture, behind, colour)
    strong = excess > STRONG
    if colour.pale:
        thick = _thickest(strong, SMALL // 4)
        strong = np.zeros_like(strong) if thick is None else thick
        excess = np.where(strong, excess, np.float32(0))
    patches: Blobs = blobs(strong, SMALL // 4)
    measured = [
        _measured(picture, behind, excess, complex(centre), 0.8 * float(np.sqrt(area)) + 8)
        for centre, area in zip(patches.centre, patches.area, strict=True)
    ]
    return [blob for blob in measured if blob is not None]


def _measured(
    picture: Picture, behind: Background, excess: NDArray[np.float32], middle: complex, reach: float
) -> Blob | None:
    """Return the middle of a patch, weighted by the bob's share of each pixel; None if it is too small.

    A pixel's share is the part of the way from the background's light to the bob's, in three colours.
    """
    import cv2

    r0, r1 = max(0, int(middle.imag - reach)) & ~1, min(picture.y.shape[0], int(middle.imag + reach) + 1)
    c0, c1 = max(0, int(middle.real - reach)) & ~1, min(picture.y.shape[1], int(middle.real + reach) + 1)
    shape, half = (r1 - r0, c1 - c0), (slice(r0 // 2, (r1 + 1) // 2), slice(c0 // 2, (c1 + 1) // 2))
    box = (r0, r1, c0, c1)
    change = _light(picture, box, behind.full_range) - _light(behind.picture, box, behind.full_range)
    solid = cv2.resize(
        (excess[half] > 2 * STRONG).astype(np.uint8), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST
    )[: shape[0], : shape[1]]
    if solid.sum() < SMALL:
        return None
    full = np.median(change[solid > 0], axis=0)
    share = np.clip(change @ full / float(full @ full), 0, 1.1)
    close = cv2.dilate((share > SHARE).astype(np.uint8) & cv2.dilate(solid, np.ones((3, 3), np.uint8)),
                      np.ones((7, 7), np.uint8))  # fmt: skip
    weight = np.where(close > 0, share, 0).astype(np.float64)
    area = float(weight.sum())
    v, u = np.mgrid[r0:r1, c0:c1]
    cu, cv = (weight * u).sum() / area, (weight * v).sum() / area
    uu, vv = (weight * (u - cu) ** 2).sum() / area, (weight * (v - cv) ** 2).sum() / area
    uv = (weight * (u - cu) * (v - cv)).sum() / area
    return Blob(complex(cu, cv), area, np.array([[uu, uv], [uv, vv]]))


def _excess(picture: Picture, behind: Background, colour: BobColour) -> NDArray[np.float32]:
    """Return how much more of a strong colour each pixel has than the background, at half the resolution."""
    a, b = (colour.chroma / np.hypot(*colour.chroma)).astype(np.float32)
    du = picture.u.astype(np.float32) - behind.picture.u
    dv = picture.v.astype(np.float32) - behind.picture.v
    return np.where(behind.inside, a * du + b * dv, np.float32(0))


def _pale_excess(picture: Picture, behind: Background, colour: BobColour) -> NDArray[np.float32]:
    """Return the part of the way from the background's colour to a pale bob's, so that half is `2 STRONG`."""
    change = behind.change(picture)
    way = colour.code.astype(np.float32) - _codes(behind.picture)
    size = np.maximum(np.sqrt((way**2).sum(axis=2)), np.float32(1e-3))
    along = (change * way).sum(axis=2) / size
    across = np.sqrt(np.maximum((change**2).sum(axis=2) - along**2, 0))
    likely = behind.inside & (size > CONTRAST) & (across < ALIKE * along)
    return np.where(likely, np.float32(4 * STRONG) * along / size, np.float32(0))


def _difference(codes: NDArray[np.float32], code: Array) -> NDArray[np.float32]:
    """Return how far colours are from one, hue counting more than brightness."""
    off = (codes - code.astype(np.float32)) * np.array([BRIGHTNESS, HUE, HUE], dtype=np.float32)
    return np.asarray(np.sqrt((off**2).sum(axis=2)), dtype=np.float32)


def _thickest(mask: NDArray[np.bool_], least: int) -> NDArray[np.bool_] | None:
    """Return the patch into which the largest circle fits, without thinner parts such as a rod."""
    import cv2

    depth = cv2.distanceTransform(np.pad(mask.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    deepest = float(depth.max())
    if np.pi * deepest**2 < least:
        return None
    radius = max(1, round(THIN * deepest))
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    _, labels = cv2.connectedComponents(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disk))
    label = labels.flat[int(depth.argmax())]
    return np.asarray(labels == label) if label else None


def _codes(picture: Picture) -> NDArray[np.float32]:
    """Return Y, U - 128 and V - 128 at half the resolution, (rows, columns, 3)."""
    import cv2

    rows, columns = picture.u.shape
    y = cv2.resize(picture.y, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.float32)
    return np.stack([y, picture.u.astype(np.float32) - 128, picture.v.astype(np.float32) - 128], axis=2)


def _light(picture: Picture, box: Box, full_range: bool) -> NDArray[np.float32]:
    """Red, green and blue light of a part of a picture, (rows, columns, 3), which a shutter adds up."""
    import cv2

    r0, r1, c0, c1 = box
    half = slice(r0 // 2, (r1 + 1) // 2), slice(c0 // 2, (c1 + 1) // 2)
    y = picture.y[r0:r1, c0:c1].astype(np.float32)
    u, v = (
        cv2.resize(p[half].astype(np.float32) - 128, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR)
        for p in (picture.u, picture.v)
    )
    u, v = u[: r1 - r0, : c1 - c0], v[: r1 - r0, : c1 - c0]
    if not full_range:
        y, u, v = (y - 16) * (255 / 219), u * (255 / 224), v * (255 / 224)
    codes = np.stack([y + 1.402 * v, y - 0.344 * u - 0.714 * v, y + 1.772 * u], axis=-1) / 255
    codes = np.clip(codes, 0, 1)
    light = light_of(codes)
    return np.asarray(light, dtype=np.float32)
