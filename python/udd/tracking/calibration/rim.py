"""The disk's rim: its centre among the marks, and how many pixels its radius has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.tracking.geometry.pose import DiskAppearance, Motion, Pose
from udd.video.reader import Picture, Plane, TrackError

RAYS = 180
SPAN = (1.08, 1.55)  # of the marks' reach: where the rim may lie
SHIFT = 0.2  # pixels by which light or lens may shift a rim in the picture
ROUNDS = 20
FEWEST = 60  # points of a rim
SEEN = 0.03  # share of the rays on which a rim must show: fewer may be the edges of other things
LEAST = 0.01  # pixels: the radius is known no better
CLEAR, SHARE = (
    25.0,
    0.25,
)  # of 255 of light, and of the disk's light: the wall must be darker by the lesser
SMEAR = 3.0  # pixels each side of the rim that lens and compression blur


@dataclass(frozen=True)
class Rim:
    """The rim in the body frame [pixels]: centre offset from the marks' origin, radius, standard errors."""

    centre: complex
    radius: float
    sigma: float  # of the radius
    centre_sigma: float  # of each of the centre's coordinates
    points: int


def outline(
    frames: Sequence[tuple[Picture, Pose, Motion]],
    look: DiskAppearance,
    view: NDArray[np.bool_],
    span: tuple[float, float] = SPAN,
    short: Sequence[float] = (),
    across: complex = 1.0,
) -> Rim:
    """Circle through the rim points of many frames, in the frame that turns with the disk.

    Light, shadow or lens shift the whole rim in the picture; if the disk turns, this is distinguished from
    its centre. The rim is looked for within `span` of the marks' reach. `short` is the relative stretch of
    each frame's disk (below 0: foreshortened) in the direction `across`.
    """
    angles = np.arange(RAYS) * (2 * np.pi / RAYS)
    rays = np.exp(1j * angles)
    points, turns, group = [], [], []
    for number, (picture, pose, motion) in enumerate(frames):
        late = _late(pose.centre + sum(span) / 2 * look.reach * rays, look, picture.y.shape[0])
        r = _rim(picture.y, view, np.asarray(pose.centre + motion.rate * late), rays, look, span)
        ok = np.isfinite(r)
        turn = pose.angle + motion.spin * late[ok]
        seen = r[ok] * rays[ok]
        if short:
            seen = seen - short[number] / (1 + short[number]) * (seen * np.conj(across)).real * across
        points.append(seen * np.exp(-1j * turn))
        turns.append(np.exp(1j * turn))
        group.append(np.full(int(ok.sum()), number))
    z = np.concatenate(points) if points else np.empty(0, dtype=complex)
    if len(z) < max(FEWEST, SEEN * RAYS * len(frames)):
        raise TrackError("the disk's rim does not stand out from the background, so it gives no scale")
    return turning_circle(z, np.concatenate(turns), np.concatenate(group))


def turning_circle(
    points: NDArray[np.complex128], turned: NDArray[np.complex128], frame: NDArray[np.int_]
) -> Rim:
    """Circle through points of a body, given by how far (as a unit number) it had turned in each one's frame.

    All of a frame's points may be shifted alike in the picture, by as much in every frame.
    """
    fitted = np.array([0.0, 0.0, 0.0, 0.0, np.median(np.abs(points))])  # centre, shift in the picture, radius
    prior = np.diag([0.0, 0.0, SHIFT**-2, SHIFT**-2, 0.0])
    for _ in range(ROUNDS):
        design, rest, spread = _radial(points, turned, fitted)
        far = (rest / (2 * spread)) ** 2
        pull = (rest / (1 + far) / spread**2)[:, None] * design  # what is far off pulls less
        normal = design.T @ (design / (1 + far[:, None])) / spread**2 + prior
        change = np.linalg.solve(normal, pull.sum(axis=0) - prior @ fitted)
        fitted = fitted + change
        if np.abs(change).max() < 1e-6:
            break
    # frames are the independent pieces: edges within one share the light and the compression
    frames = np.unique(frame)
    pulls = np.array([pull[frame == k].sum(axis=0) for k in frames])
    stiff = (1 - far) / (1 + far) ** 2 / spread**2  # how a point's pull changes with its distance
    inverse = np.linalg.inv(design.T @ (stiff[:, None] * design) + prior)
    variance = np.diag(inverse @ (pulls.T @ pulls + prior) @ inverse) if len(frames) > 1 else np.full(5, 0.25)
    off, sigma = float(np.sqrt(variance[:2].mean())), max(float(np.sqrt(variance[4])), LEAST)
    return Rim(complex(fitted[0], fitted[1]), float(fitted[4]), sigma, off, len(points))


def _radial(
    points: NDArray[np.complex128], turned: NDArray[np.complex128], circle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Linearise the distance of points from a circle by centre, shift and radius; return also its scatter."""
    arm = points - complex(circle[0], circle[1]) - complex(circle[2], circle[3]) / turned
    body = arm / np.abs(arm)
    picture, rest = body * turned, np.abs(arm) - circle[4]
    design = np.column_stack([body.real, body.imag, picture.real, picture.imag, np.ones(len(rest))])
    return design, rest, max(1.48 * float(np.median(np.abs(rest - np.median(rest)))), 0.02)


def _late(plane: NDArray[np.complex128], look: DiskAppearance, height: int) -> NDArray[np.float64]:
    """Return the delay of the rows of points of the plane relative to the middle row [s]."""
    rows = look.lens.picture(plane).imag
    return np.asarray(look.readout * ((rows + 0.5) / height - 0.5))


def _rim(
    y: Plane,
    view: NDArray[np.bool_],
    centre: NDArray[np.complex128],
    rays: NDArray[np.complex128],
    look: DiskAppearance,
    span: tuple[float, float],
) -> NDArray[np.float64]:
    """Radius of the half-height crossing along each ray from its centre [pixels], NaN where none is clear."""
    import cv2

    step, reach = 0.5, look.reach
    radii = np.arange(span[0] * reach, span[1] * reach, step)
    at = look.lens.picture(centre[:, None] + radii[None, :] * rays[:, None])
    map_u, map_v = at.real.astype(np.float32), at.imag.astype(np.float32)
    light = cv2.LUT(y, look.light.astype(np.float32))
    profile = cv2.remap(light, map_u, map_v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    profile = profile.astype(np.float64)
    clear = cv2.remap(view.astype(np.uint8), map_u, map_v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    fall = profile[:, :-4] - profile[:, 4:]
    k = np.argmax(fall, axis=1) + 2
    n = int(SMEAR / step)
    out = np.full(len(rays), np.nan)
    rows = np.flatnonzero((k >= 2 * n + 2) & (k <= len(radii) - 2 * n - 3))
    if not len(rows):
        return out
    # profile and view about each ray's steepest fall
    window = rows[:, None], k[rows, None] + np.arange(-2 * n, 2 * n)[None, :]
    part, open_ = profile[window], clear[window].all(axis=1)
    inner, outer = np.median(part[:, :n], axis=1), np.median(part[:, 3 * n :], axis=1)
    half = (inner + outer) / 2
    below = part[:, n : 3 * n + 1] < half[:, None]
    first = np.argmax(below, axis=1)
    good = open_ & (inner - outer >= np.minimum(CLEAR, SHARE * inner)) & below.any(axis=1) & (first > 0)
    at = n + first[good]
    before, after = part[good, at - 1], part[good, at]
    fraction = (before - half[good]) / (before - after)
    out[rows[good]] = radii[k[rows[good]] - 2 * n + at - 1] + step * fraction
    return out
