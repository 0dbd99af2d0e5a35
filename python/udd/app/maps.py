"""Sections, diagrams and exponents for the page, from udd's public functions."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from udd.attractors import bifurcation
from udd.chaos.largest_exponent import lyapunov
from udd.chaos.poincare_sections import poincare
from udd.errors import ModelError
from udd.models import Disk, Model, beyond_the_edge

from . import limits
from .page_models import page_model
from .spec import Start, drive_of

Array = NDArray[np.float64]

_TRANSIENT = 60  # crossings left out
VALUES = (20, 60, 300)  # of the drive: a first picture at once, then better ones
_FIRST_STARTS = 1  # of the first picture: it comes three times as fast
_KEPT = 40  # points of every orbit in a diagram


def _worker_threads() -> int:
    """Leave a core to the run that is watched."""
    return max(1, (os.cpu_count() or 2) - 1)


def section(start: Start, surface: str, count: int) -> tuple[Array, str]:
    """Crossings of a surface, shape (n, dim), and how the orbit ended."""
    surfaces = page_model(start.model).surfaces
    if surface not in surfaces:
        raise ModelError(f"no section is called {surface!r}; there are {', '.join(surfaces)}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the outcome says it
        crossings = poincare(
            beyond_the_edge(start.model),
            surfaces[surface][0],
            min(count, limits.POINTS),
            state0=list(start.state),
            transient=_TRANSIENT,
            threads=_worker_threads(),
            progress=False,
        )
    return np.ascontiguousarray(crossings.state), str(crossings.outcome)


@dataclass(frozen=True)
class Diagram:
    """Section points over the drive: ``points`` is (starts, values, points, dim)."""

    values: Array
    label: Array
    period: Array
    points: Array


@dataclass(frozen=True)
class Exponents:
    """The largest exponent over the drive, with its standard error."""

    values: Array
    exponent: Array
    error: Array


def starts_of(start: Start) -> Array:
    """Return the initial states of a diagram: the page's state, its mirror image, and a third one."""
    state = np.array(start.state)
    mirrored = state.copy()
    mirrored[:2] *= -1.0
    third = np.zeros(len(state))
    third[:3] = page_model(start.model).third
    return np.array([state, mirrored, third])


def diagram(start: Start, low: float, high: float, count: int) -> Diagram:
    """Compute the diagram over so many values of the drive."""
    model, name = beyond_the_edge(start.model), drive_of(start.model)
    starts = starts_of(start)[: _FIRST_STARTS if count == VALUES[0] else None]
    return _diagram(model, name, np.linspace(low, high, count), starts)


def warm_up() -> None:
    """Compute a small diagram: the first question then waits for no import."""
    diagram(Start(Disk(0.1), (0.0, 0.001, 0.04, 0.0)), 0.1, 0.101, 2)


def exponents(start: Start, low: float, high: float, count: int) -> Exponents:
    """Compute the largest exponents over so many values of the drive."""
    model, name = beyond_the_edge(start.model), drive_of(start.model)
    return _exponents(model, name, np.linspace(low, high, count))


def _diagram(model: Model, name: str, values: Array, starts: Array) -> Diagram:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what has no verdict has label 0
        attractors = bifurcation(
            model,
            name,
            values,
            n=_KEPT,
            transient=_TRANSIENT if len(values) >= VALUES[-1] else _TRANSIENT // 2,
            initial_states=starts,
            max_extension=1 if len(values) == VALUES[0] else 6,  # which takes five times as long
            threads=_worker_threads(),
            progress=False,
        )
    points = np.stack([attractors[state].values[0] for state in model.state_names], axis=-1)
    label, period = (attractors[key].values[0].astype(float) for key in ("attractor", "period"))
    return Diagram(values, label, period, np.ascontiguousarray(points))


def _exponents(model: Model, name: str, values: Array) -> Exponents:
    time, enough = page_model(model).exponent
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the error is drawn
        value, error = lyapunov(
            model,
            parameters={name: values},
            t=time,
            transient=time / 4,
            tol=enough,
            threads=_worker_threads(),
            progress=False,
            with_error=True,
        )
    return Exponents(values, value, error)
