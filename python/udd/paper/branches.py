"""Branch of steadily rotating states over the drive, with its eigenvalues and Hopf points."""

from __future__ import annotations

import functools

from udd import effects
from udd.bifurcations import BifurcationPoint, Branch, continuation, equilibria
from udd.models import DLE, Disk

from . import device

#: The paper's B as the disk's relaxation b = B/L [1/m].
RELAXATION = device.B / device.L


def relaxed(W: float, b: float, momentum: str = "constraint") -> Disk:
    """Return the disk with a relaxation of the rolling constraint, valid past its edge."""
    model = device.disk(W, beyond=True)
    return model.with_effects([effects.relaxation(b=b, momentum=momentum)]) if b else model


@functools.cache
def rotation_of_dle(damping: float, low: float = 0.02, high: float = 8.0) -> Branch:
    """Continue the clockwise rotation of the DLE over the drive w."""
    model = DLE(1.0, B=damping)
    return _branch(model, [1.0, 1.0, 0.0], "w", low, high)


@functools.cache
def rotation_of_disk(b: float, momentum: str = "constraint", low: float = 0.02, high: float = 0.3) -> Branch:
    """Continue the clockwise rotation of the disk over the drive W [m/s], with a relaxation b [1/m]."""
    W = 0.08
    return _branch(relaxed(W, b, momentum), [*device.rotating(W), 0.0], "W", low, high)


def hopf(branch: Branch) -> BifurcationPoint | None:
    """Return the point at which the stability changes, or None."""
    return next(iter(branch.find("Hopf")), None)


def _branch(model: DLE | Disk, guess: list[float], parameter: str, low: float, high: float) -> Branch:
    rests = equilibria(model, near=guess, initial_states=2)
    rotating = max(rests, key=lambda rest: float(rest.state[0]))
    return continuation(rotating, parameter, (low, high), ds_max=0.05)
