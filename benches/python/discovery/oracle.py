"""Score the truth: the true law and the true constants, from the same frames.

Where udd can hold the law, its own filter starts the free runs, so that only the model differs. Where it
cannot, the state at each start is fitted to the same second of data by Gauss and Newton over the true flow,
which knows the true noise and camera too: that scores some 10 % better than udd's filter.
"""

from __future__ import annotations

import numpy as np
from cases import Record
from laws import LIBRARY
from units import TRAIN

import udd
from udd.discovery.validation.held_out_errors import _windows, held_out_errors
from udd.errors import ModelError
from udd.fitting import fit_record, record_of

DISK = udd.Disk.profile.discovery
_SMALL = np.array([1e-4, 1e-7, 1e-7, 1e-6])
_HUBER = 2.5


def oracle(drawn: Record) -> dict[float, float]:
    """Median held-out error by horizon, in m."""
    if all(law.kind.name in LIBRARY for law in drawn.world.laws):
        try:
            return _by_udd(drawn)
        except ModelError:  # a strong effect may be stronger than udd's own range
            pass
    return own(drawn)


def _by_udd(drawn: Record) -> dict[float, float]:
    """The true model with udd's filter; only the camera is fitted."""
    d = drawn.world.device
    effects = []
    for law in drawn.world.laws:
        values = dict(zip(law.kind.amplitudes, law.amplitudes, strict=True)) | law.shape
        momentum = {"momentum": law.momentum} if law.momentum else {}
        effects.append(getattr(udd.effects, law.kind.name)(**values, **momentum))
    model = udd.Disk(d.W, k0=d.k0, k1=d.k1, k2=d.k2, effects=effects)
    record = record_of(drawn.measurement)
    train = record.first(TRAIN)
    fitted = fit_record(drawn.measurement, record.part(train), model, [], search=True)
    errors = held_out_errors(fitted, record, ~train)
    return dict(zip(errors.horizons, errors.median.tolist(), strict=True))


def own(drawn: Record) -> dict[float, float]:
    """The true flow from starts fitted to the same windows; nothing of udd but the choice of frames."""
    record = record_of(drawn.measurement)
    windows, ends, horizons = _windows(record, ~record.first(TRAIN), DISK.horizons, DISK.filter_window)
    t = record.t * (1 + drawn.camera.clock)
    seen, there = record.seen, record.observed.all(axis=1)
    frames = windows[:, :1] + np.arange(windows[0, 1] - windows[0, 0] + 1)
    x = drawn.motion(t[windows[:, 0]])  # the truth is a fair first guess: the fit moves to where the data say
    for _ in range(3):
        looks = _run(drawn, x, t, frames)
        moved = [_run(drawn, x + h * e, t, frames) for h, e in zip(_SMALL, np.eye(4), strict=True)]
        slopes = np.stack([(m - looks) / h for m, h in zip(moved, _SMALL, strict=True)], axis=-1)
        seen_as, slopes_as = _look(drawn, looks), _turn(drawn, looks, slopes)
        sd = drawn.camera.sd(looks[..., 0].ravel()).reshape(*looks.shape[:2], 3)
        off = (seen[frames] - seen_as) / sd
        far = np.linalg.norm(off, axis=-1, keepdims=True)
        weight = np.where(there[frames][..., None], np.sqrt(np.minimum(1, _HUBER / np.maximum(far, 1e-9))), 0)
        a = (slopes_as / sd[..., None] * weight[..., None]).reshape(len(x), -1, 4)
        b = (np.where(there[frames][..., None], off, 0) * weight).reshape(len(x), -1)
        size = np.sqrt((a**2).sum(axis=1)) + 1e-12
        a = a / size[:, None, :]
        step = np.linalg.solve(a.transpose(0, 2, 1) @ a, np.einsum("nkp,nk->np", a, b)[..., None])[..., 0]
        x = x + step / size
    last = _run(drawn, x, t, frames)[:, -1]
    ahead = np.column_stack([windows[:, 1], ends])
    predicted = _look(drawn, _run(drawn, last, t, ahead)[:, 1:])
    distance = np.hypot(*(predicted - seen[ends])[..., :2].transpose(2, 0, 1))
    distance[~there[ends]] = np.nan
    return dict(zip(horizons, np.nanmedian(distance, axis=0).tolist(), strict=True))


def _run(drawn: Record, x: np.ndarray, t: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """States at each window's frames from its first, (n, k, 4)."""
    states = [x]
    for k in range(1, frames.shape[1]):
        begin, dt = t[frames[:, k - 1]], t[frames[:, k]] - t[frames[:, k - 1]]
        parts = max(int(np.ceil(float(dt.max()) / 0.005)), 1)
        states.append(drawn.world.step(begin, states[-1], dt, parts))
    return np.stack(states, axis=1)


def _look(drawn: Record, states: np.ndarray) -> np.ndarray:
    """Return the camera's view of states without noise, to first order in its times."""
    camera, w = drawn.camera, drawn.world.device.W
    omega, y, z, beta = np.moveaxis(states, -1, 0)
    late = -camera.row * z
    y, z, beta = y + late * z * omega, z + late * (w - y * omega), beta + late * omega
    right, up = camera.marks
    y, z = y + right * np.cos(beta) + up * np.sin(beta), z - right * np.sin(beta) + up * np.cos(beta)
    c, s, size = np.cos(camera.tilt), np.sin(camera.tilt), 1 + camera.scale
    y, z = size * (c * y + s * z) + camera.offset[0], size * (c * z - s * y) + camera.offset[1]
    return np.stack([y, z, beta - camera.lag * omega + camera.tilt], axis=-1)


def _turn(drawn: Record, states: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """How a change of the start changes what is seen, (n, k, 3, 4)."""
    h = 1e-6
    return np.stack(
        [(_look(drawn, states + h * slopes[..., j]) - _look(drawn, states)) / h for j in range(4)], axis=-1
    )
