"""A record by way of a film: the motion is filmed with a camera's defects, and the film is tracked."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from motion import Run

import udd
from udd.film import Defects, render

SAMPLING = 500.0  # samples of the motion per second: the film maker draws cubics through them


@dataclass(frozen=True)
class Sampled:
    """A motion as the film maker takes it."""

    t: np.ndarray
    state: np.ndarray


def filmed(motion: Run, duration: float, rng: np.random.Generator) -> udd.Measurement:
    """The motion as a tracked film shows it; the film's defects are drawn."""
    t = np.arange(0, duration, 1 / SAMPLING)
    frames = int(duration * 25)
    defects = Defects(
        clutter=int(rng.integers(0, 6)),
        bars=int(rng.integers(0, 2)),
        off_axis=tuple(rng.normal(0, 0.05, 2)),
        lens=float(rng.normal(0, 0.01)),
        readout=float(rng.uniform(0, 0.6)),
        gradient=float(rng.uniform(-0.3, 0.3)),
        flicker=float(rng.uniform(0, 0.05)),
        wobble=float(rng.uniform(0, 0.03)),
        mark_offsets=tuple(map(tuple, rng.normal(0, 3e-4, (4, 2)))),
        dropped=tuple(np.flatnonzero(rng.random(frames) < 0.01).tolist()),
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        render(
            Sampled(t, motion(t)),
            path,
            exposure=float(rng.uniform(4e-3, 12e-3)),
            tilt=float(rng.normal(0, 0.02)),
            noise=float(rng.uniform(1, 4)),
            quality=float(rng.uniform(16, 24)),
            defects=defects,
            rng=int(rng.integers(1 << 31)),
        )
        return udd.track(path)
