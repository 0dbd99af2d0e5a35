"""Falls of the disk to one side and the other, in a run or a film."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from udd._util.angles import wrapped

Array = NDArray[np.float64]

#: Largest angle from straight down [rad] at which the centre counts as resting at a plateau of theta.
PLATEAU = 0.3


@dataclass(frozen=True)
class Falls:
    """Statistics of the centre's falls between its passages of the contact.

    Attributes
    ----------
    side : ndarray of int, shape (n,)
        Side of the fall: the sign of Y as the centre passes the contact downward, 1 to the right.
    rose : ndarray of int, shape (n,)
        Side of the contact on which it rose before.
    turns : ndarray of int, shape (n,)
        Change of theta in whole turns, clockwise, from hanging before the ascent to hanging after the fall.
    plateau : float
        Share of time in which theta is within 0.3 rad of hanging.
    rising : float
        Share of time in which Z increases.
    ascent, descent : float
        Median time [s] from the lowest point to the top, and from there to the lowest point of the fall.
    """

    side: NDArray[np.int64]
    rose: NDArray[np.int64]
    turns: NDArray[np.int64]
    plateau: float
    rising: float
    ascent: float
    descent: float

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Lengths of runs of falls to the same side."""
        return np.array([len(list(group)) for _, group in groupby(self.side.tolist())], dtype=np.int64)


def falls(t: Array, Y: Array, Z: Array) -> Falls:
    """Compute the falls in a motion that is sampled much faster than it swings.

    Parameters
    ----------
    t, Y, Z : ndarray, shape (n,)
        Times [s] and the centre [m].
    """
    theta = np.unwrap(np.arctan2(Y, Z))
    up = np.flatnonzero((Z[:-1] < 0) & (Z[1:] >= 0)) + 1
    down = np.flatnonzero((Z[:-1] >= 0) & (Z[1:] < 0)) + 1
    down = down[np.searchsorted(down, up[0], "right") :] if len(up) else down[:0]
    pairs = list(zip(up.tolist(), down.tolist(), strict=False))  # the last ascent may not have ended
    turns, ascents, descents = [], [], []
    ends = [*[first for first, _ in pairs[1:]], len(t)]
    before = 0
    for (first, last), end in zip(pairs, ends, strict=True):
        # Hanging is theta = pi, modulo whole turns; the swings about it are less than half a turn.
        hanging = np.round((np.array([theta[first], theta[last]]) - np.pi) / (2 * np.pi))
        turns.append(int(hanging[1] - hanging[0]))
        lowest, top = before + int(np.argmin(Z[before:first])), first + int(np.argmax(Z[first:last]))
        ascents.append(t[top] - t[_last_minimum(Z, lowest, first)])
        descents.append(t[last + int(np.argmin(Z[last:end]))] - t[top])
        before = last
    swing = np.abs(wrapped(theta))
    step = np.diff(t)
    return Falls(
        side=np.array([int(np.sign(Y[last])) for _, last in pairs], dtype=np.int64),
        rose=np.array([int(np.sign(Y[first])) for first, _ in pairs], dtype=np.int64),
        turns=np.array(turns, dtype=np.int64),
        plateau=float(step[np.pi - swing[1:] < PLATEAU].sum() / step.sum()),
        rising=float(step[np.diff(Z) > 0].sum() / step.sum()),
        ascent=float(np.median(ascents)) if ascents else float("nan"),
        descent=float(np.median(descents)) if descents else float("nan"),
    )


def _last_minimum(Z: Array, first: int, last: int) -> int:
    """Return the index at which the last swing turned upward for good."""
    turning = np.flatnonzero(
        (Z[first + 1 : last - 1] < Z[first : last - 2]) & (Z[first + 1 : last - 1] <= Z[first + 2 : last])
    )
    return first + 1 + int(turning[-1]) if len(turning) else first
