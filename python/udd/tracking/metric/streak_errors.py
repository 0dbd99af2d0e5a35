"""Errors along and across a mark's streak, distinguished by the residuals of the marks of one disk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, moved_by_pose
from udd.tracking.passes.local_motion import LocalMotion
from udd.tracking.passes.tracks import Tracks

Array = NDArray[np.float64]
OUTLIER = 6.0  # times the median square; a mark beyond does not count for the others
SAME = 0.7  # pixels: the disk is where it was before
FEWEST = 20  # poses that show how large errors are
LEAST = 0.05  # share of the misfit that either direction has at least


def new_poses(tracks: Tracks, reach: float) -> NDArray[np.bool_]:
    """Mark the frames that show the disk as no earlier frame does, (n,); all if these are too few.

    The frames of a disk at rest all have the same error, so that together they count as one.
    """
    out = np.zeros(len(tracks), dtype=bool)
    rows = np.flatnonzero(tracks.tracked)
    turned = np.mod(tracks.angle[rows], 2 * np.pi) * reach
    at = np.column_stack([tracks.centre[rows].real, tracks.centre[rows].imag, turned])
    _, first = np.unique(np.round(at / SAME), axis=0, return_index=True)
    out[rows[first] if len(first) >= FEWEST else rows] = True
    return out


def mark_residuals(tracks: Tracks, new: NDArray[np.bool_]) -> Array:
    """Return the residuals of the marks (n, marks, 2) without what is common to all poses: a mark's place.

    `new` marks the frames with a new pose.
    """
    turn = np.exp(1j * tracks.angle)[:, None]
    off = tracks.residuals @ np.array([1, 1j]) * turn.conj()
    seen = np.isfinite(off[new]).any(axis=0)
    usual = off[new][:, seen]
    off[:, seen] -= np.nanmedian(usual.real, axis=0) + 1j * np.nanmedian(usual.imag, axis=0)
    off *= turn
    return np.stack([off.real, off.imag], axis=-1)


def unit_covariance(
    tracks: Tracks, look: DiskAppearance, off: Array, group: NDArray[np.int_], new: NDArray[np.bool_]
) -> Array:
    """Covariance (n, 3, 3) of (u, v, beta) for a misfit of 1 per coordinate that is left over.

    Along its streak a mark fades over many pixels. Errors that these share, by compression, light and blur,
    move it further than the noise of single pixels does.
    `off` is what the marks leave over.
    `group` numbers the frames (below 0: none) whose streaks are so alike that the ratio is taken to be, too.
    """
    out = np.full((len(tracks), 3, 3), np.nan)
    around = LocalMotion(tracks)
    tracked = tracks.tracked
    for number in np.unique(group[group >= 0]):
        members = [int(k) for k in np.flatnonzero((group == number) & tracked)]
        frames = [_marks(tracks, look, off, around, k) for k in members]
        ratio = _ratio([f for k, f in zip(members, frames, strict=True) if f is not None and new[k]])
        for k, frame in zip(members, frames, strict=True):
            out[k] = np.linalg.inv(tracks.information[k]) if frame is None else _covariance(frame[0], ratio)
    return out


def _marks(
    tracks: Tracks, look: DiskAppearance, off: Array, around: LocalMotion, k: int
) -> tuple[Array, Array] | None:
    """Return the derivatives of a frame's marks by the pose, (2 marks, 3), and their residuals, (2 marks,).

    Each mark has a row along its streak and one across, both in units of the noise assumed. None where it is
    not known whither the marks move.
    """
    here = around.at(k)
    used = np.isfinite(tracks.chi2[k])
    if here is None or used.sum() < 2:
        return None
    arm = look.places[used] * np.exp(1j * tracks.angle[k])
    moving = here.rate + 1j * here.spin * arm
    if not np.abs(moving).all():
        return None
    way = moving / np.abs(moving)
    axes = np.stack([way.real, way.imag, -way.imag, way.real], axis=-1).reshape(-1, 2, 2)
    values, vectors = np.linalg.eigh(axes @ tracks.marks[k][used].astype(float) @ axes.transpose(0, 2, 1))
    root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :] @ vectors.transpose(0, 2, 1) @ axes
    design = (root @ moved_by_pose(arm)).reshape(-1, 3)
    return design, (root @ off[k][used][..., None]).ravel()


def _left(design: Array) -> Array:
    """Return the matrix from errors of the coordinates to their residuals after the fit of the pose."""
    return np.asarray(np.eye(len(design)) - design @ np.linalg.solve(design.T @ design, design.T))


def _ratio(frames: list[tuple[Array, Array]]) -> Array:
    """Misfit along streaks and across them, with the mean 1: the variances that make both squares."""
    if not frames:
        return np.ones(2)
    squares = np.concatenate([(off**2).reshape(-1, 2) for _, off in frames])
    most = OUTLIER * np.median(squares, axis=0)
    misfits = np.minimum(squares, most).sum(axis=0)
    made = np.zeros((2, 2))
    for design, _ in frames:
        marks = len(design) // 2
        made += (_left(design) ** 2).reshape(marks, 2, marks, 2).sum(axis=(0, 2))
    if np.linalg.cond(made) > 1e3:  # too few marks to tell
        return np.ones(2)
    each = np.linalg.solve(made, misfits)
    each = np.maximum(each, LEAST * each.max())
    return np.asarray(each / each.mean())


def _covariance(design: Array, ratio: Array) -> Array:
    """Return the covariance of a pose from its residuals, at a misfit of 1 per spare coordinate."""
    variance = np.tile(ratio, len(design) // 2)
    solved = np.linalg.solve(design.T @ design, design.T)
    spare = len(design) - 3
    return np.asarray((solved * variance) @ solved.T * spare / (np.diag(_left(design)) @ variance))
