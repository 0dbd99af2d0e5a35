"""A camera with its defects, applied to a motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from motion import Run
from scipy.signal import lfilter

FPS = 25.0
PICTURE = 0.2  # m from the picture's middle to its edge, where the lens' distortion is stated
_SHUTTER = 9  # looks during an exposure


@dataclass(frozen=True)
class Camera:
    """Faults of a camera: lengths in m, angles in rad, times in s."""

    noise: float = 5e-4
    angle_noise: float = 0.01
    blur: float = 0.0  # growth of the noise with the speed, s: its share of `noise` per rad/s
    exposure: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    marks: tuple[float, float] = (0.0, 0.0)
    tilt: float = 0.0
    scale: float = 0.0
    lag: float = 0.0
    clock: float = 0.0
    row: float = 0.0  # s per m of height
    lens: float = 0.0  # relative at the picture's edge
    middle: tuple[float, float] = (0.0, 0.0)
    outliers: float = 0.0
    colour: float = 0.0  # correlation of neighbouring frames' noise
    lost: float = 0.0
    gap: float = 0.0

    def sd(self, omega: np.ndarray) -> np.ndarray:
        """Standard deviation of the noise, (n, 3)."""
        size = 1 + self.blur * np.abs(omega)
        return size[:, None] * np.array([self.noise, self.noise, self.angle_noise])


def drawn(rng: np.random.Generator, precise: bool, *, hard: bool) -> Camera:
    """A camera as they come; a hard one has coloured noise and a lens too."""
    camera = Camera(
        noise=5e-5 if precise else 5e-4,
        angle_noise=1e-3 if precise else 0.01,
        blur=rng.uniform(0, 0.1),
        exposure=rng.uniform(2e-3, 12e-3),
        offset=tuple(rng.normal(0, 1.5e-3, 2)),
        marks=tuple(rng.normal(0, 5e-4, 2)),
        tilt=rng.normal(0, 0.015),
        scale=rng.normal(0, 0.004),
        lag=rng.normal(0, 3e-3),
        clock=rng.normal(0, 1e-3),
        row=rng.normal(0, 0.03),
        outliers=rng.uniform(0.01, 0.02),
        lost=rng.uniform(0, 0.03),
    )
    more: dict[str, Any] = {
        "colour": rng.uniform(0, 0.6),
        "lens": rng.normal(0, 0.01),
        "middle": tuple(rng.normal(0, 0.02, 2)),
        "gap": rng.choice([0.0, 1.0]),
    }
    return replace(camera, **more) if hard else camera


#: One defect at a time, strong, beside plain noise.
ALONE: dict[str, dict[str, Any]] = {
    "noise": {},
    "blur": {"blur": 0.15},
    "exposure": {"exposure": 0.02},
    "offset": {"offset": (3e-3, -3e-3)},
    "marks": {"marks": (1e-3, 1e-3)},
    "tilt": {"tilt": 0.035},
    "scale": {"scale": 0.01},
    "lag": {"lag": 0.008},
    "clock": {"clock": 0.002},
    "row": {"row": 0.05},
    "lens": {"lens": 0.02, "middle": (0.02, -0.02)},
    "outliers": {"outliers": 0.03},
    "colour": {"colour": 0.6},
    "lost": {"lost": 0.05, "gap": 1.0},
}


def film(
    camera: Camera, run: Run, duration: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Times as the camera states them, and what it saw: (n,), (n, 3); NaN where a frame was lost."""
    t = np.arange(0, duration - 0.5 / FPS, 1 / FPS)
    n = len(t)
    height = run(t)[:, 2]
    shutter = camera.exposure * ((np.arange(_SHUTTER) + 0.5) / _SHUTTER - 0.5)
    looks = t[:, None] + shutter - camera.row * height[:, None]
    state, turned = run(looks), run(looks - camera.lag)
    _omega, y, z, beta = np.moveaxis(state, -1, 0)
    # The marks' centre is not the disk's.
    right, up = camera.marks
    y, z = y + right * np.cos(beta) + up * np.sin(beta), z - right * np.sin(beta) + up * np.cos(beta)
    c, s, size = np.cos(camera.tilt), np.sin(camera.tilt), 1 + camera.scale
    y, z = size * (c * y + s * z), size * (c * z - s * y)
    away = (y - camera.middle[0]) ** 2 + (z - camera.middle[1]) ** 2
    bent = camera.lens * away / PICTURE**2
    y, z = y + bent * (y - camera.middle[0]), z + bent * (z - camera.middle[1])
    seen = np.column_stack(
        [
            y.mean(axis=1) + camera.offset[0],
            z.mean(axis=1) + camera.offset[1],
            turned[:, :, 3].mean(axis=1) + camera.tilt,
        ]
    )
    white = rng.standard_normal((n, 3))
    rho = camera.colour
    start = white[:1] * (1 / np.sqrt(1 - rho**2) - 1) if rho else 0 * white[:1]
    white[:1] += start
    noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white, axis=0)
    far = np.where(rng.random(n) < camera.outliers, 8.0, 1.0)
    seen += camera.sd(state[:, _SHUTTER // 2, 0]) * far[:, None] * noise
    seen[rng.random(n) < camera.lost] = np.nan
    if camera.gap:
        first = int(rng.uniform(0.1, 0.9) * n)
        seen[first : first + round(camera.gap * FPS)] = np.nan
    return t / (1 + camera.clock), seen
