"""Discoveries on small simulated records, made once for all tests of what is drawn and said about them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

import udd
from disk_cache import cached_on_disk
from simulated import film

DRIVE = 0.042


@cached_on_disk
def search_with_progress(measurement: Any, model: Any, **options: Any) -> tuple[udd.Discovery, list[str]]:
    """`udd.discover`, with the lines of its progress, once per run for each record, model and options."""
    lines: list[str] = []
    return udd.discover(measurement, model, progress=lines.append, **options), lines


def search(measurement: Any, model: Any, **options: Any) -> udd.Discovery:
    """`udd.discover`, once per run for each record, model and options."""
    return search_with_progress(measurement, model, **options)[0]


@functools.cache
def disk() -> udd.Discovery:
    """A disk whose rolling constraint is relaxed."""
    model = udd.Disk(DRIVE, effects=[udd.effects.relaxation(b=6.0)])
    measured, _ = film(model, np.random.default_rng(3), 20.0)
    return search(measured, udd.Disk(DRIVE))


@functools.cache
def nothing() -> udd.Discovery:
    """A disk that lacks nothing."""
    measured, _ = film(udd.Disk(DRIVE), np.random.default_rng(3), 30.0)
    return search(measured, udd.Disk(DRIVE))


def in_air() -> tuple[udd.Measurement, udd.Pendulum]:
    """A pendulum's record in air, and the model that knows viscous friction only."""
    rng = np.random.default_rng(3)
    t = np.arange(0, 40, 0.05)
    truth = udd.Pendulum(0.6, k0=0.004, effects=[udd.effects.quadratic_drag(c=0.02)])
    theta = udd.simulate(truth, t, [0.0, 1.0]).state[:, 1] + 2e-3 * rng.standard_normal(len(t))
    return udd.Measurement(t, {"theta": theta}), udd.Pendulum(0.6, k0=0.01)


@functools.cache
def pendulum() -> udd.Discovery:
    """A pendulum in air."""
    return search(*in_air())


@functools.cache
def outside() -> udd.Discovery:
    """A disk with seven waves of torque per turn: no effect of the library does that."""
    truth = udd.Disk(0.045, effects=[udd.effects.uneven_disk(a=0.03, b=0.0, n=7)])
    measured, _ = film(truth, np.random.default_rng(4), 40.0)
    return search(measured, udd.Disk(0.045))
