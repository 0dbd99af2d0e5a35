"""Compute the information of a record about a law if states, device and camera are unknown.

The information of the Cramer-Rao bound for the assumed model error, computed at the truth and without udd:
linearised flows from one frame to the next, and one sparse solve. It gives an effect's detection limit: the
amplitude at which chi2 is expected to fall by what it takes to be accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from camera import Camera
from laws import Law
from motion import Run, World
from scipy import sparse
from scipy.sparse.linalg import splu

ARM = 0.1  # m from the picture's middle, where a fit tells the lens
_SMALL = np.array([1e-4, 1e-7, 1e-7, 1e-6])  # steps of finite differences, per state
DEVICE = ("k0", "k1", "k2", "W")


@dataclass(frozen=True)
class Assumed:
    """Assumptions of a fit: model error per square root of a second, and priors."""

    diffusion: tuple[float, ...]
    device: dict[str, float]
    camera: dict[str, float]


def information(
    world: World, law: Law, motion: Run, camera: Camera, assumed: Assumed, t: np.ndarray
) -> np.ndarray:
    """Information (q, q) on the law's amplitudes from frames at times t, equally spaced.

    The law need not be one of the world's; its amplitudes are then taken at zero.
    """
    x = motion(t)
    dt = float(t[1] - t[0])
    others = tuple(one for one in world.laws if one is not law)
    here = law.amplitudes if law in world.laws else (0.0,) * len(law.amplitudes)

    def flow(states: np.ndarray, device: object = None, amplitudes: Sequence[float] = here) -> np.ndarray:
        mine = replace(law, amplitudes=tuple(amplitudes))
        changed = World(device or world.device, (*others, mine))  # type: ignore[arg-type]
        return changed.step(t[:-1], states, dt)

    a = x[:-1]
    jacobian = np.stack(
        [(flow(a + h * e) - flow(a - h * e)) / (2 * h) for h, e in zip(_SMALL, np.eye(4), strict=True)],
        axis=-1,
    )
    columns = []
    for name in DEVICE:
        value = getattr(world.device, name)
        up, down = (replace(world.device, **{name: value * f}) for f in (1 + 1e-5, 1 - 1e-5))
        columns.append((flow(a, up) - flow(a, down)) / (2e-5 * value))
    columns += [np.zeros_like(a)] * len(assumed.camera)
    rate = (motion(t[1:] + 1e-5) - motion(t[1:] - 1e-5)) / 2e-5
    columns.append(dt * rate)  # the clock
    unit = _units(law)
    for k, e in enumerate(unit):
        h = 1e-4 * np.eye(len(unit))[k] * e
        up, down = (flow(a, None, np.add(here, s * h)) for s in (1, -1))
        columns.append((up - down) / (2e-4 * e))
    forcing = np.stack(columns, axis=-1)
    return _left_over(jacobian, forcing, *_seen(x, t, motion, camera, assumed), assumed, dt, len(unit))


def _units(law: Law) -> list[float]:
    """A typical size of each amplitude, for finite differences only."""
    return [max(abs(a), 1e-4) for a in law.amplitudes]


def _seen(
    x: np.ndarray, t: np.ndarray, motion: Run, camera: Camera, assumed: Assumed
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """How the camera's unknowns move what is seen (n, 3, c), the weights (n, 3), and the priors."""
    omega, y, z, beta = x.T
    n, zero, one = len(x), np.zeros(len(x)), np.ones(len(x))
    rate = (motion(t + 1e-5) - motion(t - 1e-5)) / 2e-5
    curve = (motion(t + 1e-3) - 2 * x + motion(t - 1e-3)) / 1e-6
    across, upward = y - camera.middle[0], z - camera.middle[1]
    away = (across**2 + upward**2) / ARM**2
    moves = {
        "y0": (one, zero, zero),
        "z0": (zero, one, zero),
        "tilt": (z, -y, one),
        "scale": (y, z, zero),
        "right": (np.cos(beta), -np.sin(beta), zero),
        "up": (np.sin(beta), np.cos(beta), zero),
        "lag": (zero, zero, -omega),
        "row": tuple(-z * r for r in rate.T[1:]),
        "shutter": tuple(curve.T[1:]),
        "lens": (across * away, upward * away, zero),
    }
    known = assumed.camera
    camera_columns = [np.column_stack(moves[name]) for name in known]
    nothing = [np.zeros((n, 3))]
    columns = [*nothing * len(DEVICE), *camera_columns, *nothing]
    priors = [assumed.device[name] for name in DEVICE] + list(known.values()) + [assumed.device["clock"]]
    return np.stack(columns, axis=-1), 1 / camera.sd(omega), priors


def _left_over(
    jacobian: np.ndarray,
    forcing: np.ndarray,
    camera: np.ndarray,
    weight: np.ndarray,
    priors: list[float],
    assumed: Assumed,
    dt: float,
    q: int,
) -> np.ndarray:
    """Information on the last q unknowns when all others are unknown too."""
    n, p = len(weight), len(priors)
    tight = 1 / (np.array(assumed.diffusion) * np.sqrt(dt))
    look = np.zeros((n, 3, 4))
    look[:, [0, 1, 2], [1, 2, 3]] = weight
    seen = sparse.block_diag(list(look))
    row = np.arange(4 * (n - 1))
    forward = sparse.csr_matrix((np.tile(tight, n - 1), (row, row + 4)), shape=(4 * (n - 1), 4 * n))
    back = sparse.block_diag(list(tight[:, None] * jacobian))
    back = sparse.hstack([back, sparse.csr_matrix((4 * (n - 1), 4))])
    states = sparse.vstack([seen, forward - back]).tocsc()
    border = np.zeros((3 * n + 4 * (n - 1), p + q))
    border[: 3 * n, :p] = (weight[:, :, None] * camera).reshape(3 * n, p)
    border[3 * n :] = -(tight[:, None] * forcing).reshape(4 * (n - 1), p + q)
    size = np.sqrt((border**2).sum(axis=0)) + 1e-300
    border = border / size
    across = states.T @ border
    schur = border.T @ border - across.T @ splu((states.T @ states).tocsc()).solve(across)
    # The state that an angle starts from is seen as well as any other; only parameters have priors.
    schur[:p, :p] += np.diag(1 / (np.array(priors) * size[:p]) ** 2)
    rest = schur[p:, p:] - schur[p:, :p] @ np.linalg.solve(schur[:p, :p], schur[:p, p:])
    return rest * np.outer(size[p:], size[p:])
