"""Discoveries on small simulated records, made once for all tests of what is drawn and said about them."""

from __future__ import annotations

import functools

import numpy as np

import udd
from simulated import film

DRIVE = 0.042


@functools.cache
def disk() -> udd.Discovery:
    """A disk whose rolling constraint is relaxed."""
    model = udd.Disk(DRIVE, effects=[udd.effects.relaxation(b=6.0)])
    measured, _ = film(model, np.random.default_rng(3), 40.0)
    return udd.discover(measured, udd.Disk(DRIVE))


@functools.cache
def nothing() -> udd.Discovery:
    """A disk that lacks nothing."""
    measured, _ = film(udd.Disk(DRIVE), np.random.default_rng(3), 30.0)
    return udd.discover(measured, udd.Disk(DRIVE))


@functools.cache
def pendulum() -> udd.Discovery:
    """A pendulum in air."""
    rng = np.random.default_rng(3)
    t = np.arange(0, 40, 0.05)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1] + 2e-3 * rng.standard_normal(len(t))
    return udd.discover(udd.Measurement(t, {"theta": theta}), udd.Pendulum(0.6, k0=0.01))
