"""Synthetic films of the paper's runs, and their tracked motion."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from udd._util.atomic_files import write_whole
from udd.measurement import Measurement, read_measurement

from . import device

_STEP = 0.005  # s between samples of the run


@dataclass(frozen=True)
class Recipe:
    """Run and film settings.

    Attributes
    ----------
    W : float
        Drive, m/s.
    start : tuple of float
        [Omega, Y, Z, beta].
    duration : float
        Length, s.
    seed : int
        Seed of the camera's noise.
    quality : float
        Compression quality, as in :func:`udd.render`. At a poor quality a disk at rest freezes, errors and
        all, and a fit mistakes that for many independent frames.
    """

    W: float
    start: tuple[float, float, float, float]
    duration: float
    seed: int
    quality: float = 24.0


RECIPES = {
    "0.0": Recipe(0.0, device.ZERO_START, 3.0, 1, quality=12.0),
    "1.4": Recipe(device.SLOW, device.SLOW_START, 45.0, 2),
    "3.9": Recipe(0.039, device.FAST_START, 16.0, 3),
    "5.5": Recipe(0.055, device.FAST_START, 16.0, 4),
    "7.1": Recipe(0.071, device.FAST_START, 16.0, 5),
}


def film_of(name: str, folder: Path) -> Path:
    """Return the path of the film."""
    return folder / f"W{name}.mp4"


def measured(name: str, folder: Path, tell: Callable[[str], None]) -> Measurement:
    """Return the motion in a film; make and track the film unless the folder holds it already.

    Raises
    ------
    UddError
        The folder cannot be written to, or the extra ``track`` is not installed.
    """
    recipe = RECIPES[name]
    film, table, note = film_of(name, folder), folder / f"W{name}.csv", folder / f"W{name}.json"
    wanted = _said(recipe)
    if not (_read(note) == wanted and film.is_file() and table.is_file()):
        _make(recipe, name, film, table, tell)
        write_whole(note, json.dumps(wanted).encode())  # last: it marks a complete film
    return read_measurement(table)


def _make(recipe: Recipe, name: str, film: Path, table: Path, tell: Callable[[str], None]) -> None:
    from udd.film import render
    from udd.simulation.trajectory import integrated
    from udd.tracking import track

    t = np.arange(0.0, recipe.duration, _STEP)
    run = integrated(device.disk(recipe.W), t, recipe.start, dense=True)
    tell(f"filming W = {name} cm/s")
    render(run, film, quality=recipe.quality, rng=recipe.seed)
    tell(f"tracking the film of W = {name} cm/s")
    track(film, disk_radius=device.R).with_meta(W=recipe.W).to_csv(table)


def _said(recipe: Recipe) -> dict[str, Any]:
    """Return the settings that must be the same for a film to be used again."""
    model = repr(device.disk(recipe.W))
    said: dict[str, Any] = json.loads(json.dumps({"model": model, **asdict(recipe)}))
    return said


def _read(note: Path) -> Any:
    try:
        return json.loads(note.read_text())
    except (OSError, ValueError):
        return None
