"""Records of simulated disks as a camera would give them, with its defects: for tests and benches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

import udd
from udd.simulation.trajectory import integrated


@dataclass(frozen=True)
class Camera:
    """Errors of a camera."""

    noise: float = 5e-4
    angle_noise: float = 7e-3
    per_speed: float = 5e-5  # growth of the position's noise, m per rad/s
    offset: tuple[float, float] = (1e-3, -7e-4)
    tilt: float = 0.012
    scale: float = 0.002
    lag: float = 1e-3
    clock: float = 3e-4
    row: float = 0.01
    exposure: float = 0.01
    outliers: float = 0.01
    lost: float = 0.02
    memory: float = 0.0  # autocorrelation of the noise from frame to frame


def start_between_wheels(model: udd.Disk, duration: float, rng: np.random.Generator) -> list[float]:
    """A random start from which the disk stays between the wheels."""
    for _ in range(400):
        radius, angle = rng.uniform(0.01, 0.05), rng.uniform(0, 2 * np.pi)
        state = [rng.normal(0, 2), radius * np.sin(angle), radius * np.cos(angle), rng.uniform(0, 6)]
        if integrated(model, [0.0, duration], state, rtol=1e-7, atol=1e-9).outcome == "finished":
            return state
    raise RuntimeError("no start stays between the wheels")


def film(
    model: udd.Disk,
    rng: np.random.Generator,
    duration: float = 60.0,
    camera: Camera | None = None,
    state: list[float] | None = None,
) -> tuple[udd.Measurement, np.ndarray]:
    """A record at 25 frames a second and the true states."""
    camera = camera or Camera()
    t = np.arange(0, duration - 0.05, 0.04)
    sub = 8
    fine = ((t + 0.02)[:, None] + camera.exposure * (np.arange(sub) + 0.5 - sub / 2) / sub).ravel()
    # A tilted camera sees a tilted world; a lagging orientation is an earlier one; a clock that is fast
    # counts more.
    times = np.concatenate([[0.0], fine])
    run = integrated(model, times, state or start_between_wheels(model, duration, rng), rtol=1e-9, atol=1e-11)
    if run.outcome != "finished":  # chaos: the start was tried with a looser tolerance
        return film(model, rng, duration, camera)
    mean = run.state[1:].reshape(len(t), sub, 4).mean(axis=1)
    omega, y, z, beta = mean.T
    late = -camera.row * z
    y, z, beta = y + late * z * omega, z + late * (model.W - y * omega), beta + (late - camera.lag) * omega
    c, s, size = np.cos(camera.tilt), np.sin(camera.tilt), 1 + camera.scale
    sd = camera.noise + camera.per_speed * np.abs(omega)
    sd_angle = camera.angle_noise + camera.per_speed / 0.065 * np.abs(omega)
    far = np.where(rng.random(len(t)) < camera.outliers, 8.0, 1.0)
    honest = rng.standard_normal((3, len(t)))
    fresh, kept = [np.sqrt(1 - camera.memory**2)], [1.0, -camera.memory]
    e = far * lfilter(fresh, kept, honest) if camera.memory else far * honest
    seen = np.column_stack(
        [
            size * (c * y + s * z) + camera.offset[0] + sd * e[0],
            size * (c * z - s * y) + camera.offset[1] + sd * e[1],
            beta + camera.tilt + sd_angle * e[2],
        ]
    )
    seen[rng.random(len(t)) < camera.lost] = np.nan
    return udd.Measurement((t + 0.02) / (1 + camera.clock), seen, meta={"W": model.W, "R": model.R}), mean
