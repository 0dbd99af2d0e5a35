"""Copies of frames that a reader or a converter inserted into a film, as the motion of a bob shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.detection.frame_flags import REPEATED

Array = NDArray[np.float64]
Places = NDArray[np.complex128]

#: Frames on each side through which a polynomial goes, and its degree. If the bob turns back there, a delay
#: shows only over many frames.
_SCALES = ((4, 5), (5, 4), (10, 5), (20, 6))
_LONGEST = 3  # copies in a row
_CLEARLY = 60.0  # decrease of chi2, in units of the scatter that is left, from which on copies are sure
_SAME = 4.0  # standard deviations by which a copy may lie off
_GOOD = 4.0  # mean square of what is left, in units of the noise, up to which a polynomial follows the motion


def inserted_copies(t: Array, places: Places, flag: Sequence[str], noise: float) -> tuple[Array, list[str]]:
    """Flag copies of frames that the motion shows, and undo the delay that inserted ones cause.

    A copy in place of a frame that was lost delays nothing: the motion goes on as far ahead as its time says.

    Parameters
    ----------
    t : ndarray (n,)
        Times, s.
    places : ndarray of complex (n,)
        Place of the bob, pixels; NaN where it is not known.
    flag : sequence of str
        Those of the frames; copies that were recognised by their picture have one.
    noise : float
        Standard deviation of a place in each direction, pixels.

    Returns
    -------
    t : ndarray (n,)
        Times of the frames as they were filmed: a copy that was inserted delays all frames after it.
    flag : list of str
        With a word on the copies.
    """
    t, flags = t.copy(), list(flag)
    seen = np.isfinite(places)
    k = 1
    while k < len(t):
        count, delayed = _at(k, t, places, seen, flags, noise)
        if not count:
            k += 1
            continue
        last = k + count
        if delayed and last < len(t):
            t[last:] -= t[last - 1] - t[k - 1]
            t[k:last] = np.linspace(t[k - 1], t[last], count + 2)[1:-1]
        elif delayed:
            delayed = False  # nothing comes after it
        for i in range(k, last):
            flags[i] = f"{REPEATED}, which delays all after it" if delayed else REPEATED
        seen[k:last] = False
        k = last
    return t, flags


def _at(
    k: int, t: Array, places: Places, seen: NDArray[np.bool_], flags: Sequence[str], noise: float
) -> tuple[int, bool]:
    """Count the copies of frame k - 1 that begin with frame k; return True if they delay later frames."""
    marked = 0
    while k + marked < len(t) and flags[k + marked].startswith(REPEATED):
        marked += 1
    if marked:
        about = [_Sides.about(k, k + marked, seen, *scale) for scale in _SCALES]
        return marked, any(one.clearly(t, places, noise) is not None for one in about if one)
    same = _SAME * np.sqrt(2.0) * noise
    best = (0.0, 0, False)
    for count in range(1, _LONGEST + 1):
        last = k + count
        if last > len(t) or not seen[k - 1] or not abs(places[last - 1] - places[k - 1]) < same:
            break
        for scale in _SCALES:
            sides = _Sides.about(k, last, seen, *scale)
            if sides is None:
                continue
            for delayed in (False, True):
                gain = sides.clearly(t, places, noise, np.arange(k, last), delayed)
                if gain is not None and gain > best[0]:
                    best = (gain, count, delayed)
    return best[1], best[2]


@dataclass(frozen=True)
class _Sides:
    """Frames before and after possible copies, and the degree of a polynomial through them."""

    before: NDArray[np.int64]
    after: NDArray[np.int64]
    degree: int

    @classmethod
    def about(cls, k: int, last: int, seen: NDArray[np.bool_], around: int, degree: int) -> _Sides | None:
        """Return the frames around k to last - 1; None if too few are seen."""
        before = np.flatnonzero(seen[max(k - 2 * around, 0) : k])[-around:] + max(k - 2 * around, 0)
        after = last + np.flatnonzero(seen[last : last + 2 * around])[:around]
        return cls(before, after, degree) if len(before) == len(after) == around else None

    def clearly(
        self,
        t: Array,
        places: Places,
        noise: float,
        copies: NDArray[np.int64] | None = None,
        delayed: bool = True,
    ) -> float | None:
        """Decrease of chi2 if there are copies; None if that is not clear.

        `copies` are frames that are copies or not; None if they are known to be copies, and only the delay is
        in question.
        """
        plain = np.concatenate(
            [self.before, self.after] if copies is None else [self.before, copies, self.after]
        )
        delay = t[self.after[0] - 1] - t[self.before[-1]] if delayed else 0.0
        rows, moved = np.concatenate([self.before, self.after]), t.copy()
        moved[self.after[0] :] -= delay
        as_filmed = self._rest(t, places, plain) / noise**2
        left = self._rest(moved, places, rows) / noise**2
        scatter = left / (2 * (len(rows) - self.degree - 1))
        gain = (as_filmed - left) / max(scatter, 1.0)
        return gain if scatter < _GOOD and gain > _CLEARLY else None

    def _rest(self, t: Array, places: Places, rows: NDArray[np.int64]) -> float:
        """Return the sum of squares about a polynomial through some places, pixels squared."""
        x = t[rows] - t[rows].mean()
        powers = np.vander(x / np.abs(x).max(), self.degree + 1)
        seen = np.column_stack([places[rows].real, places[rows].imag])
        coefficients = np.linalg.lstsq(powers, seen, rcond=None)[0]
        return float(np.square(seen - powers @ coefficients).sum())
