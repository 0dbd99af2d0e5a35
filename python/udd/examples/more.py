"""Films, records and settings that the commands of the documentation use."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from udd._util.atomic_files import write_whole

from . import make

_TRACK = """\
# What is known of film.mp4; see the tracker's page in the documentation.
disk_radius = 0.08
calibrate = {lens = false}
"""
_SWEEP = """\
quantity = "lyapunov"
model = {kind = "dle", w = 1.0}
chunk = 16
[over]
w = {from = 1.0, to = 9.0, n = 32}
[options]
tol = 0.05
"""
_OWN = """\
{"states": ["x", "v"],
 "equations": {"x": "v", "v": "-k*x - c*v + mu*(1 - x^2)*v"},
 "parameters": {"k": 1.0, "c": 0.0, "mu": 1.5},
 "state0": {"x": 1.0, "v": 0.0}}
"""
_RATE, _RADIUS = 30, 120  # of the clock's film: frames a second, pixels from the pivot to the bob


def write_more(folder: Path) -> list[Path]:
    """Write them into a folder; what is there already stays."""
    made = [
        _written(folder / name, text.encode())
        for name, text in {"track.toml": _TRACK, "sweep.toml": _SWEEP, "own.json": _OWN}.items()
    ]
    records = {"slow.csv": (0.036, 5), "fast.csv": (0.044, 6)}
    made += [
        _written(folder / name, make.disk(W, seconds=20.0, seed=seed).encode())
        for name, (W, seed) in records.items()
    ]
    with as_file(files("udd") / "demo" / "sample.mp4") as sample:
        made.append(_written(folder / "film.mp4", sample.read_bytes()))
    made.append(_clock(folder / "clock.mp4"))
    return made


def _written(target: Path, content: bytes) -> Path:
    if not target.exists():
        write_whole(target, content)
    return target


def _clock(target: Path) -> Path:
    """Make the film of a plain pendulum: a red bob before a grey wall."""
    from udd.models import Pendulum
    from udd.simulation.trajectory import integrated
    from udd.video.writer import write_film

    if not target.exists():
        t = np.arange(0.0, 8.0, 1 / _RATE)
        theta = integrated(Pendulum(0.8, k0=0.01), t, [0.0, 0.45], rtol=1e-9, atol=1e-12).state[:, 1]
        write_film(target, _pictures(theta), (160, 160), Fraction(_RATE), 20.0)
    return target


def _pictures(theta: NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
    across, down = np.meshgrid(np.arange(160), np.arange(160))
    wall, bob = np.array([150, 150, 155]), np.array([200, 30, 40])
    for angle in theta.tolist():
        off = np.hypot(across - 80 - _RADIUS * np.sin(angle), down - 16 - _RADIUS * np.cos(angle))
        share = np.clip(9.5 - off, 0.0, 1.0)[..., None]
        yield (wall * (1 - share) + bob * share).astype(np.uint8)
