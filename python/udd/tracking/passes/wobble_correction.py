"""Correction of a wobbling disk: the marks show each frame's foreshortening, which is undone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, moved_by_pose

from .tracks import Tracks
from .wobble import SINE, Wobble

ROUNDS = 6  # each finds two thirds of what marks are off: poses and foreshortening take the rest

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class WobbleCorrection:
    """A wobbling disk: poses and marks as if its marks were where they are when upright."""

    tracks: Tracks
    look: DiskAppearance
    across: complex  # direction of the foreshortening
    short: Array  # (n,) relative change of each frame's length, below 0
    sigma: Array  # (n,) its standard error
    answer: Array  # (n, 3) change of the pose (u, v, beta) that a foreshortening of 1 made
    tracked: NDArray[np.bool_]

    def centred(self, at: complex, by: complex) -> WobbleCorrection:
        """With the marks' origin moved to a point among them, and they turned back by an angle."""
        angle = self.tracks.angle
        arm = at * np.exp(1j * angle)
        centre = self.tracks.centre + arm + self.short * (arm * np.conj(self.across)).real * self.across
        change = float(np.angle(by))
        marks = [replace(m, place=(m.place - at) / by, turn=m.turn - change) for m in self.look.marks]
        tracks = replace(self.tracks, centre=centre, angle=angle + change)
        return replace(self, tracks=tracks, look=replace(self.look, marks=marks))

    def look_at(self, k: int) -> DiskAppearance:
        """Return the marks as frame k shows them: foreshortened."""
        turn = np.exp(1j * self.tracks.angle[k]) if self.tracked[k] else 1.0
        moved = (
            self.short[k]
            * np.conj(turn)
            * (self.look.places * turn * np.conj(self.across)).real
            * self.across
        )
        marks = [replace(m, place=m.place + complex(z)) for m, z in zip(self.look.marks, moved, strict=True)]
        return replace(self.look, marks=marks)

    def about(self, pivot: complex) -> tuple[Tracks, Array]:
        """Return the corrected centre, and signed standard errors (n, 3) of u, v, beta with one cause.

        The wheels hold the disk at the contact, about which it is foreshortened.
        """
        away = np.where(self.tracked, self.tracks.centre - pivot, 0)
        away = (away * np.conj(self.across)).real * self.across
        moved = self.answer + np.column_stack([away.real, away.imag, np.zeros(len(away))])
        centre = self.tracks.centre - self.short * away
        return replace(self.tracks, centre=centre), moved * self.sigma[:, None]


def correct_wobble(
    tracks: Tracks, look: DiskAppearance, turning: Wobble, before: WobbleCorrection | None = None
) -> WobbleCorrection | None:
    """Correct each frame's foreshortening by the residual of its pose; None if no frame shows all marks.

    The disk is not foreshortened along the axis of its turning: if the marks are further apart there than
    they were learned, the learned distances are too small by the same factor. And they were learned from
    frames in
    which they were displaced. `before`: what the marks that the tracks come from were displaced for.
    """
    across = complex(np.exp(1j * turning.axis))
    tracked = tracks.tracked
    frames = {int(k): _Frame.of(tracks, look, int(k)) for k in np.flatnonzero(tracked)}
    whole = [k for k in frames if np.isfinite(tracks.chi2[k]).all()]
    if not whole:
        return None
    n = len(tracks)
    short = np.zeros(n) if before is None else before.short.copy()
    larger, noise = (float(np.median(x)) for x in np.transpose([frames[k].stretch(across) for k in whole]))
    # mean and variance of cos(A sin) - 1
    usual, prior = -(turning.amplitude**2) / 4, turning.amplitude**4 / SINE

    def further(k: int, places: Complexes) -> tuple[Array, Array, float, float]:
        """Return change of pose, residual, change of foreshortening and its precision for marks."""
        f = frames[k]
        change, explained = f.response(f.turn * (places - look.places))
        by, rest = f.response(f.across(across))
        left = f.left - explained
        precise = f.square(rest, rest) / noise + 1 / prior
        next_short = (f.square(rest, left) / noise + (usual - short[k]) / prior) / precise
        return change + next_short * by, left - next_short * rest, next_short, precise

    places = (1 + larger) * look.places
    for _ in range(ROUNDS):
        lefts = [(frames[k].turn, further(k, places)[1]) for k in whole]
        off = np.array([np.conj(turn) * (left[::2] + 1j * left[1::2]) for turn, left in lefts])
        places = places + np.median(off.real, axis=0) + 1j * np.median(off.imag, axis=0)
    centre, angle = tracks.centre.copy(), tracks.angle.copy()
    chi2, residuals = tracks.chi2.copy(), tracks.residuals.copy()
    sigma, answer = np.zeros(n), np.zeros((n, 3))
    for k, f in frames.items():
        change, flat, step, precise = further(k, places)
        left, used = flat.reshape(-1, 2), np.isfinite(tracks.chi2[k])
        short[k] += step
        sigma[k], answer[k] = precise**-0.5, f.response(f.across(across))[0]
        centre[k] -= complex(change[0], change[1])
        angle[k] -= float(change[2])
        chi2[k] = np.where(used, np.einsum("ka,kab,kb->k", left, tracks.marks[k], left), np.nan)
        residuals[k] = np.where(used[:, None], left, np.nan)
    tracks = replace(tracks, centre=centre, angle=angle, chi2=chi2, residuals=residuals)
    marks = [replace(m, place=complex(z)) for m, z in zip(look.marks, places, strict=True)]
    return WobbleCorrection(tracks, replace(look, marks=marks), across, short, sigma, answer, tracked)


@dataclass(frozen=True)
class _Frame:
    """Return the residuals of a frame's marks after a rigid pose, and the pose's change by each."""

    turn: complex
    arms: Complexes
    left: Array  # (2 marks,)
    weight: Array  # (2 marks, 2 marks)
    design: Array  # (2 marks, 3)
    solved: Array  # (3, 2 marks): pose for displacements

    @classmethod
    def of(cls, tracks: Tracks, look: DiskAppearance, k: int) -> _Frame:
        turn = complex(np.exp(1j * tracks.angle[k]))
        arms = look.places * turn
        design = moved_by_pose(arms).reshape(-1, 3)
        weight = np.zeros((len(design), len(design)))
        for j, information in enumerate(tracks.marks[k]):
            weight[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = information
        solved = np.asarray(np.linalg.solve(design.T @ weight @ design, design.T @ weight), dtype=np.float64)
        return cls(turn, arms, np.nan_to_num(tracks.residuals[k]).ravel(), weight, design, solved)

    def across(self, direction: complex) -> Complexes:
        """Return the displacement of the marks by a stretch of 1 in a direction."""
        return np.asarray((self.arms * np.conj(direction)).real * direction)

    def response(self, moved: Complexes) -> tuple[Array, Array]:
        """Return the pose (u, v, beta) for displacements of the marks, and the residual displacements."""
        value = np.column_stack([moved.real, moved.imag]).ravel()
        pose = self.solved @ value
        return pose, value - self.design @ pose

    def square(self, first: Array, other: Array) -> float:
        """Product by weight."""
        return float(first @ self.weight @ other)

    def stretch(self, across: complex) -> tuple[float, float]:
        """Stretch along the axis, and what is left for each spare coordinate in units of its noise."""
        rests = np.stack([self.response(self.across(d))[1] for d in (across, 1j * across)], axis=1)
        solution = np.linalg.solve(rests.T @ self.weight @ rests, rests.T @ self.weight @ self.left)
        left = self.left - rests @ solution
        return float(solution[1]), self.square(left, left) / (len(left) - 5)
