"""Discoveries on small simulated records, made once for all tests of what is drawn and said about them."""

from __future__ import annotations

import functools
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np

import udd
from simulated import film

DRIVE = 0.042


def once(find: Callable[[], udd.Discovery]) -> Callable[[], udd.Discovery]:
    """The same, found once for all processes (or twice, where two begin at the same time).

    The folder where they keep it is in the environment: `conftest` sees to that.
    """

    def found() -> udd.Discovery:
        path = Path(os.environ["UDD_DISCOVERED"]) / f"{find.__name__}.pickle"
        if path.is_file():
            kept: udd.Discovery = pickle.loads(path.read_bytes())
            return kept
        result = find()
        part = path.with_suffix(f".{os.getpid()}")
        part.write_bytes(pickle.dumps(result))
        part.replace(path)  # whole or not at all
        return result

    return functools.cache(functools.wraps(find)(found))


@once
def disk() -> udd.Discovery:
    """A disk whose rolling constraint is relaxed."""
    model = udd.Disk(DRIVE, effects=[udd.effects.relaxation(b=6.0)])
    measured, _ = film(model, np.random.default_rng(3), 40.0)
    return udd.discover(measured, udd.Disk(DRIVE))


@once
def nothing() -> udd.Discovery:
    """A disk that lacks nothing."""
    measured, _ = film(udd.Disk(DRIVE), np.random.default_rng(3), 30.0)
    return udd.discover(measured, udd.Disk(DRIVE))


@once
def pendulum() -> udd.Discovery:
    """A pendulum in air."""
    rng = np.random.default_rng(3)
    t = np.arange(0, 40, 0.05)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1] + 2e-3 * rng.standard_normal(len(t))
    return udd.discover(udd.Measurement(t, {"theta": theta}), udd.Pendulum(0.6, k0=0.01))


@once
def outside() -> udd.Discovery:
    """A disk with seven waves of torque per turn: no effect of the library does that."""
    truth = udd.Disk(0.045, effects=[udd.effects.uneven_disk(a=0.03, b=0.0, n=7)])
    measured, _ = film(truth, np.random.default_rng(4), 40.0)
    return udd.discover(measured, udd.Disk(0.045))
