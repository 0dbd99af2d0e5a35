"""Places to click on a rendered film: the middles of marks, the edge, the contact."""

from __future__ import annotations

import numpy as np

from udd.film import Film

Place = tuple[float, float]
ARM = 0.065  # m from the disk's centre to the marks' middles


def marks(film: Film, frame: int, numbers: tuple[int, ...]) -> list[Place]:
    """Middles of some marks (red 0, orange 1, blue 2, green 3) in a frame, in pixels."""
    turned = film.state[frame, 3] + np.pi / 2 * np.array(numbers)
    return _pixels(film, frame, -1j * ARM * np.exp(1j * turned))


def edge(film: Film, frame: int) -> list[Place]:
    """Three points of the disk's edge in a frame, in pixels."""
    return _pixels(film, frame, film.radius * np.exp(1j * np.array([0.3, 2.4, 4.5])))


def _pixels(film: Film, frame: int, arms: np.ndarray) -> list[Place]:
    _, y, z, _ = film.state[frame]
    at = complex(*film.pivot) + film.scale * (complex(y, -z) + arms)
    return [(float(a.real), float(a.imag)) for a in at]
