"""Small films of a marked disk, drawn here from first principles (independent of `udd.film`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 320, 400
PIVOT = (161.3, 190.6)  # pixels, u and v of pixel centres
SCALE = 1000.0  # pixels per metre
RADIUS, REACH, HALF = 0.08, 0.062, 0.009  # m: disk, marks' distance from its centre, half a mark's side
COLOURS = [(190, 35, 40), (235, 130, 35), (30, 70, 185), (35, 135, 60)]  # red, orange, blue, green (sRGB)
WHITE, WALL, BLACK = (228, 228, 220), (140, 145, 140), (25, 25, 28)
OVER = 3  # subpixels per pixel and direction
FPS = 25


@dataclass(frozen=True)
class Motion:
    """True motion on a fine grid, read off at any time."""

    t: NDArray[np.float64]
    state: NDArray[np.float64]  # Y, Z, beta

    def at(self, t: float) -> tuple[float, float, float]:
        y, z, b = (float(np.interp(t, self.t, self.state[:, k])) for k in range(3))
        return y, z, b


def rolling(
    duration: float, drive: float = 0.012, start: tuple[float, float, float] = (0.02, 0.02, 0.4)
) -> Motion:
    """A disk that turns to and fro about the contact, driven upwards: exact kinematics, made-up torque."""
    h = 1e-4
    n = round((duration + 0.2) / h)
    t = -0.1 + h * np.arange(n)
    omega = 7.0 * np.sin(2 * np.pi * (t + h / 2) / 1.3) + 2.0 * np.cos(2 * np.pi * (t + h / 2) / 0.57)
    zeta, beta = complex(start[0], start[1]), start[2]
    out = np.empty((n, 3))
    for k in range(n):
        out[k] = zeta.real, zeta.imag, beta
        turn = omega[k] * h
        zeta = zeta * np.exp(-1j * turn) + 1j * drive * h * np.exp(-0.5j * turn)
        beta += turn
    return Motion(np.asarray(t, dtype=np.float64), out)


def light(rgb: Iterable[float]) -> NDArray[np.float32]:
    x = np.asarray(list(rgb), dtype=float) / 255
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def codes(x: NDArray[np.float32]) -> NDArray[np.uint8]:
    y = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    return np.clip(np.round(255 * y), 0, 255).astype(np.uint8)


BOB = light((200, 38, 44))  # of a plain pendulum

Box = tuple[int, int, int, int]  # rows from, to, columns from, to [pixels]


def still(
    y: float,
    z: float,
    beta: float,
    box: Box = (0, HEIGHT, 0, WIDTH),
    *,
    disk: bool = True,
    marks: bool = True,
    support: bool = True,
) -> NDArray[np.float32]:
    """Light of one instant inside a box, at `OVER` times the resolution."""
    grown = 0.5  # subpixels by which fillPoly enlarges a shape: it also fills what its outline touches
    shift = 4  # cv2's fixed-point bits: corners to 1/16 subpixel
    cu, cv = PIVOT[0] + SCALE * y, PIVOT[1] - SCALE * z
    r0, r1, c0, c1 = box
    image = np.broadcast_to(light(WALL), ((r1 - r0) * OVER, (c1 - c0) * OVER, 3)).copy()

    def fill(u: NDArray[np.float64], v: NDArray[np.float64], rgb: tuple[int, int, int]) -> None:
        at = np.column_stack([u - c0, v - r0]) * OVER + (OVER - 1) / 2
        middle = at.mean(axis=0)
        at = middle + (at - middle) * (1 - grown / np.hypot(*(at - middle).T).mean())
        cv2.fillPoly(
            image,
            [np.round(at * 2**shift).astype(np.int32)],
            light(rgb).tolist(),
            lineType=cv2.LINE_8,
            shift=shift,
        )

    if disk:
        ring = np.linspace(0, 2 * np.pi, 400, endpoint=False)
        fill(cu + SCALE * RADIUS * np.cos(ring), cv + SCALE * RADIUS * np.sin(ring), WHITE)
    for k, rgb in enumerate(COLOURS if disk and marks else []):
        a = beta + k * np.pi / 2
        mu, mv = cu + SCALE * REACH * np.sin(a), cv - SCALE * REACH * np.cos(a)
        c, s = SCALE * HALF * np.cos(a), SCALE * HALF * np.sin(a)
        fill(
            np.array([mu + c - s, mu - c - s, mu - c + s, mu + c + s]),
            np.array([mv + s + c, mv - s + c, mv - s - c, mv + s - c]),
            rgb,
        )
    if support:
        u, v = PIVOT
        for left, right, top, low in ((-11, 11, -6, 400), (-24, 24, -4, 4)):
            fill(
                np.array([u + left, u + right, u + right, u + left]),
                np.array([v + top, v + top, v + low, v + low]),
                BLACK,
            )
    return image


def _shrink(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """The mean light of each pixel: what OpenCV's area mode is where whole pixels go into one."""
    h, w = image.shape[0] // OVER, image.shape[1] // OVER
    return np.asarray(cv2.resize(image, (w, h), interpolation=cv2.INTER_AREA), dtype=np.float32)


@lru_cache(maxsize=4)
def _empty(support: bool) -> NDArray[np.uint8]:
    return codes(_shrink(still(0, 0, 0, disk=False, support=support)))


def frame(
    motion: Motion,
    t: float,
    exposure: float,
    rng: np.random.Generator,
    *,
    marks: bool = True,
    support: bool = True,
) -> NDArray[np.uint8]:
    """Picture of a camera around time `t`: light added up over exposure and pixels, then grain."""
    y, z, _ = motion.at(t)
    u, v, reach = PIVOT[0] + SCALE * y, PIVOT[1] - SCALE * z, SCALE * RADIUS + 12
    box = (
        max(0, int(v - reach)),
        min(HEIGHT, int(v + reach)),
        max(0, int(u - reach)),
        min(WIDTH, int(u + reach)),
    )
    steps = 1 if exposure == 0 else 5
    times = t + exposure * ((np.arange(steps) + 0.5) / steps - 0.5)
    picture = _empty(support).astype(float)
    total = sum(still(*motion.at(float(x)), box, marks=marks, support=support) for x in times)
    picture[box[0] : box[1], box[2] : box[3]] = codes(_shrink(np.asarray(total) / np.float32(steps)))
    noisy = picture + rng.normal(0, 1.5, picture.shape)
    return np.asarray(np.clip(np.round(noisy), 0, 255).astype(np.uint8))


def write(
    path: Path, frames: Iterable[NDArray[np.uint8]], times: Callable[[int], float] = lambda i: i / FPS
) -> Path:
    """Encode at high quality with the given presentation times."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("mpeg4", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 10000)
        stream.codec_context.qmin = stream.codec_context.qmax = 2
        for i, picture in enumerate(frames):
            f = av.VideoFrame.from_ndarray(picture, format="rgb24")
            f.pts, f.time_base = round(times(i) * 10000), Fraction(1, 10000)
            out.mux(stream.encode(f))
        out.mux(stream.encode(None))
    return path


def swinging(
    theta: Callable[[float], float],
    t: float,
    exposure: float,
    rng: np.random.Generator,
    *,
    long: float = 230.0,
    radius: float = 13.0,
    pivot: tuple[float, float] = (158.3, 61.7),
    clutter: bool = True,
) -> NDArray[np.uint8]:
    """A plain pendulum: a red bob on a grey rod before a wall with a red patch; light added up."""
    angles = [theta(float(t + exposure * x)) for x in ((np.arange(5) + 0.5) / 5 - 0.5 if exposure else [0.0])]
    ends = np.array([[pivot[0] + long * np.sin(a), pivot[1] + long * np.cos(a)] for a in angles])
    low = np.floor(np.minimum(ends.min(axis=0) - radius - 3, np.array(pivot) - 3)).astype(int)
    high = np.ceil(np.maximum(ends.max(axis=0) + radius + 3, np.array(pivot) + 3)).astype(int)
    (c0, r0), (c1, r1) = np.maximum(low, 0), np.minimum(high, (WIDTH, HEIGHT))
    shift = 4
    paint = BOB.tolist()

    def at(u: float, v: float) -> list[int]:
        return [round((OVER * z + (OVER - 1) / 2) * 2**shift) for z in (u - c0, v - r0)]

    total = np.zeros(((r1 - r0) * OVER, (c1 - c0) * OVER, 3), dtype=np.float32)
    for u, v in ends:
        image = np.broadcast_to(light(WALL), ((r1 - r0) * OVER, (c1 - c0) * OVER, 3)).copy()
        if clutter:
            cv2.circle(image, at(40, 350), 20 * OVER << shift, paint, -1, cv2.LINE_8, shift)
        cv2.line(image, at(*pivot), at(u, v), light((90, 92, 95)).tolist(), 2 * OVER, cv2.LINE_AA, shift)
        size = round((radius * OVER - 0.5) * 2**shift)  # cv2 fills what the outline touches
        cv2.circle(image, at(u, v), size, paint, -1, cv2.LINE_8, shift)
        total += image
    picture = _wall(clutter).astype(float)
    picture[r0:r1, c0:c1] = codes(_shrink(total / np.float32(len(ends))))
    noisy = picture + rng.normal(0, 1.5, picture.shape)
    return np.asarray(np.clip(np.round(noisy), 0, 255).astype(np.uint8))


@lru_cache(maxsize=2)
def _wall(clutter: bool) -> NDArray[np.uint8]:
    picture = np.broadcast_to(light(WALL), (HEIGHT, WIDTH, 3)).copy()
    if clutter:
        cv2.circle(picture, (40, 350), 20, BOB.tolist(), -1)
    return codes(picture)
