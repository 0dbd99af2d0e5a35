"""The coordinates in which states are compared: without units, angles as points on a circle."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .base import Model

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Coordinates:
    """Coordinates in which states of a model are compared.

    Attributes
    ----------
    size : ndarray (dim,)
        Divisor of each component. Infinity removes an angle that the rates do not depend on.
    angle : ndarray of bool (dim,)
        True for components that count modulo 2 pi.
    clock : float
        A typical time of the motion, in the model's unit of time.
    mirrors : tuple of ndarray (dim,)
        Changes of sign under which the equations of motion stay the same. The identity is left out.
    """

    size: Floats
    angle: NDArray[np.bool_]
    clock: float
    mirrors: tuple[Floats, ...]

    def __call__(self, states: Floats) -> Floats:
        """Convert states (..., dim) to points (..., m) with meaningful distances."""
        plain = (
            states[..., ~self.angle & np.isfinite(self.size)]
            / self.size[~self.angle & np.isfinite(self.size)]
        )
        turned = states[..., self.angle & np.isfinite(self.size)]
        return np.concatenate([plain, np.cos(turned), np.sin(turned)], axis=-1)

    def speed(self, model: Model, states: Floats) -> Floats:
        """Compute the distance that states (n, dim) move in a typical time: zero at an equilibrium."""
        rates = model.rates(np.zeros(len(states)), states) * self.clock / self.size
        speed: Floats = np.abs(rates).max(axis=-1, initial=0.0)
        return speed


def coordinates_of(model: Model, states: Floats) -> Coordinates:
    """Make the coordinates for a model; `states` (n, dim) give sizes of components without one."""
    sizes, clock = _sizes(model)
    largest = np.abs(states).max(axis=0, initial=0.0)
    size = np.array(
        [sizes.get(name, float(top) or 1.0) for name, top in zip(model.state_names, largest, strict=True)]
    )
    angle = np.array([name in model.angles for name in model.state_names])
    probes = probes_of(model, size, seed=1)
    for k in np.flatnonzero(angle):
        turned = probes.copy()
        turned[:, k] += 1.0
        if same_rates(_rates(model, probes), _rates(model, turned)):
            size[k] = np.inf
    return Coordinates(size, angle, clock, tuple(_mirrors(model, probes)))


def probes_of(model: Model, size: Floats, seed: int, count: int = 8) -> Floats:
    """Draw generic states of these sizes (dim,), the same in every process.

    If the rates are undefined at some of them, as a root is below zero, their absolute values come too.
    """
    probes: Floats = size * np.random.default_rng(seed).uniform(-0.9, 0.9, (count, len(size)))
    if np.isfinite(_rates(model, probes)).all():
        return probes
    return np.concatenate([probes, np.abs(probes)])


def same_rates(first: Floats, second: Floats) -> bool:
    """Return True if rates (n, dim) agree to the bit, and in each component at least once as numbers."""
    defined = np.isfinite(first).any(axis=0).all()
    return bool(defined and np.array_equal(first, second, equal_nan=True))


def depends_on_time(model: Model, size: Floats, after: float) -> bool:
    """Return True if the rates differ after this time or are nowhere defined; False if no formula has `t`."""
    if not model.names_time:
        return False
    probes = probes_of(model, size, seed=2)
    now, later = (model.rates(np.full(len(probes), t), probes) for t in (0.0, after))
    return not same_rates(now, later)


def _sizes(model: Model) -> tuple[dict[str, float], float]:
    """Return typical sizes of a predefined model's components, and its typical time."""
    sizes = model.profile.dynamics.sizes
    return ({}, 1.0) if sizes is None else sizes(model.parameters)


def _rates(model: Model, states: Floats) -> Floats:
    return model.rates(np.zeros(len(states)), states)


def _mirrors(model: Model, probes: Floats) -> list[Floats]:
    rates = _rates(model, probes)
    symmetries = []
    for signs in product((1.0, -1.0), repeat=probes.shape[1]):
        sign = np.array(signs)
        # To the bit: a changed sign costs no rounding.
        if (sign < 0).any() and same_rates(_rates(model, sign * probes), sign * rates):
            symmetries.append(sign)
    return symmetries
