"""Outliers of a record: frames, or short blocks of frames, that no smooth motion passes through."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator
from scipy.ndimage import maximum_filter1d

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: A frame is an outlier if its distance exceeds this times the typical one; normal noise does in 1 of 1e8.
_ODD = 9.0
_END, _JUMP = 8, 30.0  # Frames at an end of a run; no motion jumps there by so many of their steps.
_LEAP = 0.5  # Share of the steps before and after that a bend of the motion does not reach.
# A kink is this much closer to the lines through its sides than to the cubic, and its sides are as straight.
_KINK = 0.2
_CLEANED = 8  # Rounds of outlier detection: outliers close to each other hide each other.
_LONGEST = 20  # frames of a block
_NOISE = 3.0  # Standard deviations by which the mean speed between two frames may be wrong.
_AROUND, _LEAST = 5, 4  # Steps on each side of a block that show the motion's speed, and the fewest.
#: A jump exceeds the range of the speeds around it by more than the first factor times the range. The motion
#: across a block exceeds it by at most the second.
_BEYOND, _BRIDGE = 2.0, 1.0
_RARE, _FEW = 0.005, 3  # Share of the frames, or number, above which blocks are spikes of the motion.
_CODE = 3.0  # Distance of a code from the other values, in ranges of these.
_REPEATS, _VALUES = 3, 10  # The fewest frames with a code, and the fewest other values.
_MOST = 0.25  # Share of the frames above which codes or blocks are a part of the motion.
# An outlier at an end of a block is off by this share of the largest distance, or the path of the block is
# longer than up and down once by this factor.
_ABRUPT, _ONCE = 0.2, 1.2
_AS_FAST = 0.5  # Share of a jump's speed above which another step is such a jump too.


def odd_frames(t: Array, guess: Array, sigma: Array, linked: Flags) -> Flags:
    """Detect codes for missing values, blocks of outliers, and frames far from the cubic through others.

    Parameters
    ----------
    t : ndarray (n,)
    guess : ndarray (n, m)
        The channels.
    sigma : ndarray (m,)
        Their noise.
    linked : ndarray of bool (n - 1,)
        True if a frame continues the motion of the one before.

    Returns
    -------
    ndarray of bool (n,)
        True for frames in which any channel is an outlier.
    """
    codes = np.any([_codes(channel) for channel in guess.T], axis=0)
    sigma = np.maximum(sigma, [_rounding(channel) for channel in guess.T])
    odd = _odd_blocks(t, guess, sigma, linked, codes)
    odd |= _odd_ends(guess, sigma, linked)
    return _odd_singles(t, guess, sigma, linked, odd)


def interpolated(x: Array, odd: Flags) -> Array:
    """Replace the outliers of each channel (n, m) by interpolation over the other frames."""
    number, result = np.arange(len(x), dtype=np.float64), x.copy()
    for channel in result.T:
        channel[odd] = akima(number[odd], number[~odd], channel[~odd])
    return result


def akima(at: Array, there: Array, column: Array) -> Array:
    """Interpolate by Akima's method, which follows a motion's curvature; constant beyond the ends."""
    result: Array = Akima1DInterpolator(there, column)(np.clip(at, there[0], there[-1]))
    return result


def _codes(x: Array) -> Flags:
    """Detect a code for missing values: a repeated extreme value far beyond the range of all others.

    A value of many frames is no code: the motion rests there, such as a tank that is empty at first.
    """
    odd = np.zeros(len(x), dtype=bool)
    values, counts = np.unique(x, return_counts=True)
    while len(values) > _VALUES:
        for end, rest in ((0, values[1:]), (-1, values[:-1])):
            gap = abs(values[end] - rest[end])
            if _REPEATS <= counts[end] <= _MOST * len(x) and gap > _CODE * np.ptp(rest):
                odd |= x == values[end]
                values, counts = rest, counts[1:] if end == 0 else counts[:-1]
                break
        else:
            break
    return odd


def _rounding(x: Array) -> float:
    """Return the noise that the resolution of a channel causes; it is near 0 if values hardly repeat."""
    steps = np.diff(np.unique(x))
    steps = steps[steps > 8 * np.finfo(np.float64).eps * np.abs(x).max()]
    return float(steps.min()) / np.sqrt(12.0) if len(steps) else 0.0


class _Steps(NamedTuple):
    """Steps between frames that are no outliers so far.

    Attributes
    ----------
    t : ndarray (n,)
    x : ndarray (n, m)
    run : ndarray of int (n,)
        Number of each frame's run of linked frames.
    speed : ndarray (n - 1, m)
        Mean speed from each frame to the next.
    dt : ndarray (n - 1, 1)
    noise : ndarray (m,)
        Noise of a difference between frames.
    """

    t: Array
    x: Array
    run: NDArray[np.int64]
    speed: Array
    dt: Array
    noise: Array

    def ranges(self, width: int, first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return the least and largest speed in so many steps before and after each of these frames.

        The shapes are (k, m, 2). The speeds are NaN near the ends of a run, where fewer than `_LEAST` of
        these steps exist.
        """
        inside = np.where((np.diff(self.run) == 0)[:, None], self.speed, np.nan)
        padded = np.pad(inside, ((width, width), (0, 0)), constant_values=np.nan)
        windows = sliding_window_view(padded, width, axis=0)

        def extremes(speeds: Array) -> Array:
            result = np.stack([np.fmin.reduce(speeds, axis=-1), np.fmax.reduce(speeds, axis=-1)], axis=-1)
            result[(~np.isnan(speeds)).sum(axis=-1) < _LEAST] = np.nan
            return result

        return extremes(windows[first]), extremes(windows[width + last])

    def jumps(self, numbers: NDArray[np.int64], ranges: Array) -> Flags:
        """Return True for each of these steps and each channel if its speed is far outside a range."""
        low, high = ranges[..., 0], ranges[..., 1]
        excess = np.maximum(self.speed[numbers] - high, low - self.speed[numbers])
        is_fast: Flags = excess > _BEYOND * (high - low)
        return is_fast & (excess * self.dt[numbers] > _ODD * self.noise)

    def bridges(
        self, first: NDArray[np.int64], last: NDArray[np.int64], ranges: Array, share: float
    ) -> Flags:
        """Return True for each pair of frames and each channel if the motion can pass through both.

        The mean speed between them exceeds the range by at most this share of it, and by the noise.
        """
        low, high = ranges[..., 0], ranges[..., 1]
        time = (self.t[last] - self.t[first])[:, None]
        speed = (self.x[last] - self.x[first]) / time
        excess = np.maximum(speed - high, low - speed)
        result: Flags = excess <= share * (high - low) + _NOISE * self.noise / time
        return result


class _Block(NamedTuple):
    """Frames from `start` to before `end`, which of them are outliers, and the speed of the jumps.

    The speed is that of the slower jump at either end in each channel, infinite in channels without a jump.
    """

    start: int
    end: int
    odd: Flags
    speed: Array


def _odd_blocks(t: Array, x: Array, sigma: Array, linked: Flags, odd: Flags) -> Flags:
    """Detect blocks of outliers: the motion jumps, jumps back, and continues as if there were no block.

    A jump is a step whose speed lies far outside the range of the speeds before and after the block. A kick
    or an impact bends the motion, but its speed stays within that range. Both ends of a block are jumps, so
    a good frame next to an outlier does not belong to it.
    """
    run = np.concatenate([[0], np.cumsum(~linked)])
    codes = odd
    blocks: list[tuple[NDArray[np.int64], Array]] = []
    for _ in range(_CLEANED):
        kept = np.flatnonzero(~odd)
        more = _blocks(t[kept], x[kept], sigma, run[kept])
        if not more:
            break
        odd = odd.copy()
        for block in more:
            frames = kept[block.start : block.end][block.odd]
            odd[frames] = True
            blocks.append((frames, block.speed))
    # Jumps that recur are spikes of the motion, whether or not the other jumps belong to blocks.
    number = sum(bool((np.diff(frames) == 1).any()) for frames, _speed in blocks)
    most = max(_RARE * len(t), _FEW)
    if number > most or (odd & ~codes).sum() > _MOST * len(t):
        return codes
    is_step = linked & ~odd[1:] & ~odd[:-1]
    steps = np.abs(np.diff(x, axis=0) / _durations(t))[is_step]
    odd = codes.copy()
    for frames, speed in blocks:
        if number + 0.5 * (steps > _AS_FAST * speed).any(axis=1).sum() <= most:
            odd[frames] = True
    return codes | (odd & ~_gradual(t, x, odd))


def _durations(t: Array) -> Array:
    """Return the durations of the steps, (n - 1, 1); a short one would exaggerate the noise of the speed."""
    dt = np.diff(t)
    result: Array = np.maximum(dt, 0.5 * float(np.median(dt)))[:, None]
    return result


def _blocks(t: Array, x: Array, sigma: Array, run: NDArray[np.int64]) -> list[_Block]:
    """List blocks that do not overlap, the shortest first."""
    if len(t) < 2 * _LEAST + 3:
        return []
    dt = _durations(t)
    steps = _Steps(t, x, run, np.diff(x, axis=0) / dt, dt, np.sqrt(2.0) * sigma)
    numbers = np.arange(len(dt))
    before, _after = steps.ranges(_AROUND, numbers, numbers)
    starts = np.flatnonzero(steps.jumps(numbers, before).any(axis=1)) + 1
    taken = np.zeros(len(t), dtype=bool)
    result: list[_Block] = []
    for length in range(1, _LONGEST + 1) if len(starts) else ():
        for block in _blocks_of(steps, starts[starts < len(t) - length], length):
            if not taken[block.start - 1 : block.end + 1].any():
                taken[block.start : block.end] = True
                result.append(block)
    return result


def _blocks_of(steps: _Steps, starts: NDArray[np.int64], length: int) -> Iterator[_Block]:
    """Yield the blocks of so many frames that begin at one of the `starts`."""
    first, last = starts - 1, starts + length
    before, after = steps.ranges(max(length, _AROUND), first, last)
    ranges = np.stack(
        [np.minimum(before[..., 0], after[..., 0]), np.maximum(before[..., 1], after[..., 1])], axis=-1
    )
    is_odd = (
        steps.jumps(first, ranges)
        & steps.jumps(last - 1, ranges)
        & steps.bridges(first, last, ranges, _BRIDGE)
    )
    is_odd[steps.run[first] != steps.run[last]] = False
    for k in np.flatnonzero(is_odd.any(axis=1)):
        channels = is_odd[k]
        # Good frames between two outliers stay.
        inner = np.arange(starts[k], last[k])
        before_inner, after_inner = np.full(length, first[k]), np.full(length, last[k])
        is_reached = steps.bridges(before_inner, inner, ranges[[k]], 0.0)
        is_reached &= steps.bridges(inner, after_inner, ranges[[k]], 0.0)
        odd: Flags = ~np.all(is_reached[:, channels], axis=1)
        if odd.any():
            speed = np.abs(steps.speed[[first[k], last[k] - 1]]).min(axis=0)
            yield _Block(int(starts[k]), int(last[k]), odd, np.where(channels, speed, np.inf))


def _gradual(t: Array, x: Array, odd: Flags) -> Flags:
    """Return True for three or more outliers in a row that go away from the motion and come back gradually.

    Such a spike of the motion begins or ends near it, even if its first step far exceeds the steps before,
    and it goes up and down once.
    """
    result = np.zeros(len(t), dtype=bool)
    scale = np.ptp(x, axis=0) + np.finfo(np.float64).tiny
    for frames in np.split(np.arange(len(t)), np.flatnonzero(np.diff(odd)) + 1):
        if len(frames) < 3 or not odd[frames[0]] or frames[0] == 0 or frames[-1] == len(t) - 1:
            continue
        around = np.arange(frames[0] - 1, frames[-1] + 2)
        line = (t[around] - t[around[0]])[:, None] / (t[around[-1]] - t[around[0]])
        off = x[around] - x[around[0]] - line * (x[around[-1]] - x[around[0]])
        off = off[:, np.argmax(np.abs(off).max(axis=0) / scale)]
        size = np.abs(off)
        path = np.abs(np.diff(off)).sum()
        result[frames] = min(size[1], size[-2]) < _ABRUPT * size.max() and path < _ONCE * 2 * np.ptp(off)
    return result


def _odd_singles(t: Array, guess: Array, sigma: Array, linked: Flags, odd: Flags) -> Flags:
    """Detect frames far from the cubic through the two before and after, in any channel."""
    n, odd = len(guess), odd.copy()
    inside = np.zeros(n, dtype=bool)
    inside[2:-2] = linked[:-3] & linked[1:-2] & linked[2:-1] & linked[3:]
    # The frames inside a block do not show where the frames next to it should be.
    block = np.zeros(n, dtype=bool)
    block[1:-1] = odd[1:-1] & (odd[:-2] | odd[2:])
    inside &= ~maximum_filter1d(block, 5)
    if not inside.any():
        return odd
    weights, noisier = _cubic(t)
    rounding = 8 * np.finfo(np.float64).eps * np.abs(guess).max(axis=0)
    dt = np.diff(t)[:, None]
    longest = np.maximum(dt[1:-2], dt[2:-1])
    for _ in range(_CLEANED):
        off, filled = np.zeros_like(guess), interpolated(guess, odd)
        around = (filled[:-4], filled[1:-3], filled[3:-1], filled[4:])
        cubic = sum(w[:, None] * x for w, x in zip(weights, around, strict=True))
        off[2:-2] = np.abs(filled[2:-2] - cubic) / noisier[:, None]
        # An exact rest does not show the noise.
        clean = off[inside & ~odd]
        shown = [column[column > least] for column, least in zip(clean.T, rounding, strict=True)]
        typical = np.maximum([np.median(column) if len(column) else 0.0 for column in shown], sigma)
        # A film may be so precise that the motion's own bends exceed the noise: they are smaller than its
        # steps.
        speed = np.abs(np.diff(filled, axis=0)) / dt
        off[2:-2][off[2:-2] < _LEAP * longest * np.maximum(speed[:-3], speed[3:])] = 0.0
        # A kick or an impact, which a cubic does not follow, lies between the lines through its sides. So may
        # an outlier, if these sides are curved.
        sides = np.stack([2 * filled[1:-3] - filled[:-4], 2 * filled[3:-1] - filled[4:]])
        beyond = np.maximum(filled[2:-2] - sides.max(axis=0), sides.min(axis=0) - filled[2:-2])
        bend = np.pad(np.abs(np.diff(filled, 2, axis=0)), ((1, 1), (0, 0)), constant_values=np.inf)
        curvature = np.maximum(bend[:-4], bend[4:])
        off[2:-2][np.maximum(beyond, curvature) < _KINK * off[2:-2]] = 0.0
        off[~inside | odd] = 0.0
        # Only the worst of adjacent outliers is removed in a round: it distorts the cubics of the others.
        far = (off / typical).max(axis=1)
        is_odd = (far > _ODD) & (far >= maximum_filter1d(far, 5))
        if not is_odd.any():
            break
        odd |= is_odd
    return odd


def _cubic(t: Array) -> tuple[list[Array], Array]:
    """Return the weights of the cubic through the two frames before and after each frame, and its noise.

    The noise of the distance from the cubic is relative to that of even stamps, and at least 1.
    """
    at, around = t[2:-2], (t[:-4], t[1:-3], t[3:-1], t[4:])
    weights = [
        np.prod([(at - other) / (place - other) for other in around if other is not place], axis=0)
        for place in around
    ]
    even = np.sqrt(35.0 / 18.0)
    return weights, np.maximum(np.sqrt(1.0 + sum(w**2 for w in weights)) / even, 1.0)


def _odd_ends(guess: Array, sigma: Array, linked: Flags) -> Flags:
    """Detect a first or second frame of a run, or a last, that lies far beyond the steps of the next frames.

    A fast transient is no outlier: each of its steps is a share of the step before.
    """
    odd = np.zeros(len(guess), dtype=bool)
    for run in np.split(np.arange(len(guess)), np.flatnonzero(~linked) + 1):
        for frames in (run, run[::-1]) if len(run) >= 2 * _END else ():
            x = guess[frames[:_END]]
            steps = np.maximum(np.abs(np.diff(x, axis=0)), sigma)
            across = np.maximum(np.abs(x[2] - x[0]), steps[2:].max(axis=0))
            odd[frames[0]] |= (steps[0] > _JUMP * steps[1:].max(axis=0)).any()
            odd[frames[1]] |= (np.minimum(steps[0], steps[1]) > _JUMP * across).any()
    return odd
