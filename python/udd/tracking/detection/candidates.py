"""Candidate marks of a frame by colour, near their predicted places or anywhere."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, Pose
from udd.video.reader import Picture

from .colour_blobs import Blobs, blobs

SAME = 0.985  # cosine between two colours' directions above which they are one
NEAR = 0.22  # of the marks' reach: largest distance of a blob from its mark


def colours_of(
    pictures: list[Picture], poses: list[Pose], look: DiskAppearance, view: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Colour differences (U, V) of the marks' middles, shape (n, 2), from frames whose pose is known."""
    out = np.full((len(look.marks), 2), np.nan)
    for k, mark in enumerate(look.marks):
        samples = []
        for picture, pose in zip(pictures, poses, strict=True):
            at = complex(look.lens.picture(pose.centre + mark.place * np.exp(1j * pose.angle)))
            r, c = round(at.imag / 2 - 0.25), round(at.real / 2 - 0.25)
            h, w = picture.u.shape
            if 1 <= r < h - 1 and 1 <= c < w - 1 and view[2 * r, 2 * c]:
                samples.append((float(picture.u[r, c]) - 128, float(picture.v[r, c]) - 128))
        if samples:
            out[k] = np.median(np.array(samples), axis=0)
    return out


def classify(
    picture: Picture, colours: NDArray[np.float64], view: NDArray[np.bool_], box: tuple[int, int, int, int]
) -> list[Blobs]:
    """Blobs of each mark's colour inside a box (rows, columns of the full picture), in front of nothing."""
    r0, r1, c0, c1 = (x // 2 for x in box)
    u = picture.u[r0:r1, c0:c1].astype(np.float32) - 128
    v = picture.v[r0:r1, c0:c1].astype(np.float32) - 128
    open_ = view[2 * r0 : 2 * r1 : 2, 2 * c0 : 2 * c1 : 2][: u.shape[0], : u.shape[1]]
    strength = np.hypot(*colours.T)
    unit = (colours / strength[:, None]).astype(np.float32)
    along = np.stack([a * u + b * v for a, b in unit])
    best = np.argmax(along, axis=0)
    size = np.take_along_axis(along, best[None], 0)[0]
    # a streak is a pale version of its mark: same hue, down to a fifth of the strength
    strong = (size > np.maximum(0.2 * strength[best], 9.0)) & (size > 0.9 * np.hypot(u, v)) & open_
    pale = np.hypot(u, v) < max(0.2 * float(strength.min()), 9.0)
    out = []
    for alike in (unit @ unit.T > SAME) | np.eye(len(unit), dtype=bool):
        b = blobs(strong & alike[best], least=4, most=8, pale=pale)
        out.append(Blobs(b.centre + 2 * (c0 + 1j * r0), b.area))
    return out


def candidates(patches: list[Blobs], look: DiskAppearance, guess: Pose | None) -> list[Pose]:
    """Poses that two blobs or more agree on, the best supported first; `guess` breaks ties.

    Every pair of blobs of different colours at about the right distance proposes a pose; the other
    blobs near their places support it. The pose is then the rigid fit to all that support it.
    """
    patches = [Blobs(look.lens.plane(p.centre), p.area) for p in patches]
    places = np.array([m.place for m in look.marks])
    reach = look.reach
    poses: list[tuple[float, Pose]] = []
    for i, j in combinations(range(len(places)), 2):
        arm = places[j] - places[i]
        for a in patches[i].centre:
            for b in patches[j].centre:
                if abs(abs(b - a) - abs(arm)) > NEAR * reach:
                    continue
                turn = (b - a) / arm
                turn /= abs(turn)
                pose = _support(
                    patches,
                    places,
                    Pose((a + b) / 2 - turn * (places[i] + places[j]) / 2, float(np.angle(turn))),
                    reach,
                )
                if pose is not None:
                    score, p = pose
                    if guess is not None:
                        away = abs(p.centre - guess.centre) + reach * abs(
                            np.angle(np.exp(1j * (p.angle - guess.angle)))
                        )
                        score -= 0.8 * min(away / reach, 1.0)
                    poses.append((score, p))
    poses.sort(key=lambda item: -item[0])
    return [pose for _, pose in poses]


def _support(
    patches: list[Blobs], places: NDArray[np.complex128], pose: Pose, reach: float
) -> tuple[float, Pose] | None:
    expected = pose.centre + places * np.exp(1j * pose.angle)
    at, got = [], []
    score = 0.0
    for k, patch in enumerate(patches):
        if len(patch.centre):
            d = np.abs(patch.centre - expected[k])
            n = int(np.argmin(d))
            if d[n] < NEAR * reach:
                at.append(places[k])
                got.append(patch.centre[n])
                score += 1 - d[n] / (NEAR * reach)
    if len(at) < 2:
        return None
    body, seen = np.array(at), np.array(got)
    spin = np.vdot(body - body.mean(), seen - seen.mean())
    angle = float(np.angle(spin))
    return score, Pose(complex(seen.mean() - np.exp(1j * angle) * body.mean()), angle)
