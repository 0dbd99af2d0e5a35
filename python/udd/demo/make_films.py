"""Source of the sample films: ``python -m udd.demo.make_films`` makes them again.

Two films of the same device, camera and drive. In `sample.mp4` the rolling constraint is relaxed, which the
known model of the demonstration lacks; in `sample_null.mp4` nothing is added to the model.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from udd.effects import Effect, library
from udd.film import render
from udd.models import Disk
from udd.simulation.trajectory import Trajectory, integrated

DURATION = 60.0  # s
DRIVE = 0.042  # m/s
QUALITY = 24.0  # about a megabyte each
SAMPLES = {
    "sample.mp4": {"relaxation": {"b": 6.0}},
    "sample_null.mp4": {},
}


def main(folder: Path) -> None:
    """Write both films."""
    for seed, (name, hidden) in enumerate(SAMPLES.items()):
        effects = (
            s.make(momentum="constraint", treatment=None, **hidden[s.name])
            for s in library()
            if s.name in hidden
        )
        run = between_wheels(tuple(effects), seed)
        film = render(run, folder / name, quality=QUALITY, rng=seed, progress=sys.stderr.isatty())
        size = film.path.stat().st_size / 1e6
        print(f"{name}: {len(film.t)} frames, {size:.2f} MB, start {run.state[0].tolist()}")


def between_wheels(effects: tuple[Effect, ...], seed: int) -> Trajectory:
    """Return the first run from random starts that stays between the wheels."""
    random = np.random.default_rng(seed)
    model = Disk(DRIVE, effects=effects)
    times = np.arange(0.0, DURATION, 0.005)
    while True:
        radius, angle = random.uniform(0.01, 0.05), random.uniform(0, 2 * np.pi)
        start = [random.normal(0, 2), radius * np.sin(angle), radius * np.cos(angle), random.uniform(0, 6)]
        run = integrated(model, times, start, dense=True)
        if run.outcome == "finished":
            return run


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
