"""Films whose frames a converter mixed or repeated: recognised by relations between frames, and undone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .reader import Picture, Plane

Array = NDArray[np.float64]
Frame = TypeVar("Frame")
#: Frames of the camera per frames of the film: 24 in 30, 25 in 30, 30 in 60, 24 in 60, 25 in 60, ...
RATIOS = ((4, 5), (5, 6), (1, 2), (2, 5), (5, 12), (3, 5), (2, 3), (1, 3), (12, 25))
#: The same in a long cycle. A pendulum with the period of the cycle shows its frames' relation, too, but when
#: it turns back.
LONG_CYCLES = ((24, 25),)
TELECINE = ((1.0, 0, 0, 0, 0), (0, 1.0, 0, 0, 0), (0, 0.5, 0.5, 0, 0), (0, 0, 0.5, 0.5, 0),
            (0, 0, 0, 1.0, 0), (0, 0, 0, 0, 1.0))  # fmt: skip
HOW = ("mixed", "repeated", "mixed in halves")
PIXELS = 8000  # of each frame that are compared
MEMORY = 4e7  # bytes of them
MOVING = 12.0  # codes by which a pixel changes that counts, root mean square
FEWEST_PIXELS = 40
FEWEST_CYCLES = 5
GOES_ON = 0.25  # of the usual change over three frames, that there is across a copy
CONTRAST = 0.15  # of the usual misfit that a relation between frames leaves in its phase
CLEARLY = 0.3  # of the usual misfit, that it leaves in most cycles
VOTES = 0.75  # share of the cycles
MOVES = 0.05  # of the misfit of fast cycles: in a slower one nothing moves, and copies are no evidence
STEADY = 0.999  # share of a frame of the camera that the film's frames determine
NOISY = 5.0  # factor by which a separated frame may have more noise
NEGLIGIBLE = 0.01  # share of a frame


@dataclass(frozen=True)
class Conversion:
    """Conversion of a camera's frames to a film of another rate.

    Attributes
    ----------
    sources, frames : int
        So many frames of the camera make so many of the film, again and again.
    how : str
        One of ``HOW``.
    phase : int
        Number of the first frame of the film at which such a cycle begins.
    """

    sources: int
    frames: int
    how: str
    phase: int

    @property
    def text(self) -> str:
        """One sentence on what was done to the film."""
        return (
            f"a converter {self.how} frames, {self.sources} of the camera to {self.frames} of the film: "
            "these were separated again"
        )

    @cached_property
    def weights(self) -> Array:
        """Shares (frames + 1, sources + 1) of the camera's frames in those of a cycle and the next one."""
        if self.how == HOW[2]:
            return np.array(TELECINE)
        position = np.arange(self.frames + 1) * self.sources / self.frames
        if self.how == HOW[1]:
            position = np.floor(position + 0.5)
        return np.asarray(np.maximum(0.0, 1 - np.abs(position[:, None] - np.arange(self.sources + 1))))

    def undo(self, pictures: Iterable[Picture]) -> Iterator[Picture]:
        """Yield the camera's frames; those at the ends that are not determined are left out."""
        number = 0
        for block, first, last in self._blocks(pictures):
            for out in self._separated(block, first, last):
                yield replace(out, index=number)
                number += 1

    def noise(self, frames: int) -> Array:
        """Return the variance of each of the camera's frames, from a film of so many frames of variance 1."""
        parts = self._blocks(range(frames))
        shares = [each for block, first, last in parts for _, each in self._shares(len(block), first, last)]
        return np.array([float(np.square(each).sum()) for each in shares])

    def _blocks(self, frames: Iterable[Frame]) -> Iterator[tuple[list[Frame], int, bool]]:
        """Yield the frames of each cycle with the next one, the row of the first, and True for the last."""
        first = (-self.phase) % self.frames  # row of the cycle to which the film's first frame belongs
        block: list[Frame] = []
        for frame in frames:
            block.append(frame)
            if first + len(block) == self.frames + 1:
                yield block, first, False
                block, first = [frame], 0
        if block:
            yield block, first, True

    def _shares(self, count: int, first: int, last: bool) -> Iterator[tuple[int, tuple[float, ...]]]:
        """Yield the camera's frames that a block determines, and the share of each frame of the block."""
        for source, shares in _inverse(tuple(map(tuple, self.weights[first : first + count]))):
            if source < self.sources or last:  # otherwise it is the first of the next cycle
                yield source, shares

    def _separated(self, block: list[Picture], first: int, last: bool) -> Iterator[Picture]:
        """Yield the camera's frames that a block of the film determines: rows of a cycle from `first` on."""
        times = np.array([picture.t for picture in block])
        for source, shares in self._shares(len(block), first, last):
            used = [(p, s) for p, s in zip(block, shares, strict=True) if abs(s) > NEGLIGIBLE]
            at = source * self.frames / self.sources - first
            yield Picture(
                0,
                _time_at(at, times),
                _mixed([(p.y, s) for p, s in used]),
                _mixed([(p.u, s) for p, s in used]),
                _mixed([(p.v, s) for p, s in used]),
                any(p.damaged for p, _ in used),
                any(p.left_out for p, _ in used),
            )


def _time_at(at: float, times: Array) -> float:
    """Interpolate times; continue them evenly beyond their ends."""
    if len(times) < 2:
        return float(times[0])
    k = int(np.clip(np.floor(at), 0, len(times) - 2))
    return float(times[k] + (at - k) * (times[k + 1] - times[k]))


@lru_cache(maxsize=256)
def _inverse(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[int, tuple[float, ...]], ...]:
    """Return the columns that rows of weights determine, and the share of each row in them."""
    weights = np.array(rows)
    inverse = np.linalg.pinv(weights)
    steady = np.diag(inverse @ weights)
    noise = np.square(inverse).sum(axis=1)
    good = np.flatnonzero((steady > STEADY) & (noise < NOISY))
    return tuple((int(k), tuple(inverse[k].tolist())) for k in good)


def _mixed(parts: list[tuple[Plane, float]]) -> Plane:
    if len(parts) == 1:
        return parts[0][0]
    total = np.zeros(parts[0][0].shape, np.float32)
    for plane, share in parts:
        total += np.float32(share) * plane
    return np.clip(np.rint(total), 0, 255).astype(np.uint8)


class Samples:
    """A few thousand pixels of each frame of a film, from which a conversion is recognised."""

    def __init__(self, frames: int) -> None:
        self.pixels = min(PIXELS, int(MEMORY / max(frames, 1)))
        self.most = int(MEMORY / max(self.pixels, 1))
        self.rows: list[Plane] = []

    def add(self, y: Plane) -> None:
        """Take the pixels of the next frame."""
        if len(self.rows) < self.most:
            step = max(1, round((y.size / max(self.pixels, 1)) ** 0.5))
            self.rows.append(y[::step, ::step].ravel())

    def conversion(self) -> Conversion | None:
        """Return what a converter did; None if the frames have no such relation."""
        sizes = {len(row) for row in self.rows}
        if len(sizes) != 1:
            return None
        values = np.array(self.rows)
        moving = values[:: max(1, len(values) // 200)].std(axis=0) > MOVING
        if moving.sum() < FEWEST_PIXELS:
            return None
        x = values[:, moving].astype(np.float32)
        reach = max(frames for _, frames in RATIOS)
        band = np.zeros((reach + 1, len(x)))
        for lag in range(min(reach + 1, len(x))):
            band[lag, : len(x) - lag] = np.einsum("ij,ij->i", x[: len(x) - lag], x[lag:])
        each = [
            _recognised(Conversion(sources, frames, how, 0), band)
            for how in HOW
            for sources, frames in (RATIOS + LONG_CYCLES if how != HOW[2] else RATIOS[:1])
        ]
        good = [(kind.frames, kind.sources, contrast, kind) for contrast, kind in filter(None, each)]
        return min(good, default=(0, 0, 0.0, None), key=lambda c: c[:3])[3]  # most relations


def _recognised(kind: Conversion, band: Array) -> tuple[float, Conversion] | None:
    """Return the contrast of the kind's best phase, and the conversion; None if none stands out.

    The weights of a cycle's frames have more rows than columns. So some combinations of its frames vanish,
    but only if the cycle is assumed to begin at the right frame.
    """
    size, cycle = kind.frames + 1, kind.frames
    count = band.shape[1] - size + 1
    cycles = count // cycle
    if cycles < FEWEST_CYCLES:
        return None
    left, values, _ = np.linalg.svd(kind.weights)
    zero = left[:, int((values > 1e-9).sum()) :]
    product = zero @ zero.T / zero.shape[1]
    misfit = np.zeros(count)
    for a in range(size):
        for b in range(size):
            misfit += product[a, b] * band[abs(a - b), min(a, b) : min(a, b) + count]
    table = misfit[: cycles * cycle].reshape(cycles, cycle)
    table = table[table.max(axis=1) > MOVES * np.quantile(table.max(axis=1), 0.9)]
    level = np.median(table, axis=0) if len(table) >= FEWEST_CYCLES else np.ones(cycle)
    phase = int(np.argmin(level))
    contrast = float(level[phase] / max(np.median(np.delete(level, phase)), 1e-9))
    votes = float(np.mean(table[:, phase] < CLEARLY * np.median(table, axis=1))) if len(table) else 0.0
    if not (contrast < CONTRAST and votes > VOTES):
        return None
    if (kind.sources, kind.frames) in LONG_CYCLES and not _goes_on(kind, phase, band):
        return None
    return contrast, replace(kind, phase=phase)


def _goes_on(kind: Conversion, phase: int, band: Array) -> bool:
    """Return True if the motion goes on across a copy or a half mixture: frames about it differ as usual."""
    rows = np.argmax(kind.weights, axis=1)
    before = int(np.flatnonzero(np.diff(rows) == 0)[0]) - 1
    change = band[0, :-3] + band[0, 3:] - 2 * band[3, :-3]
    across = change[(phase + before) % kind.frames :: kind.frames]
    return bool(np.median(across) > GOES_ON * np.median(change))
