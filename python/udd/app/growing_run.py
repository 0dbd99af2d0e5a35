"""A run that grows while it is watched, piece by piece, with the bits of one call of `udd.simulate`."""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from udd.errors import ModelError, UddError
from udd.models import Model
from udd.simulation.energy import EnergyBalance, angular_momentum, energy_balance
from udd.simulation.trajectory import Trajectory, integrated

from . import limits
from .page_models import page_model
from .spec import Start, key_of

Array = NDArray[np.float64]

RATE = 240  # states per second that passes on the page
_FIRST = 4.0  # s of the first call


def clock_of(model: Model) -> float:
    """Return the model's time that passes in a second on the page."""
    return page_model(model).clock


def per_unit(model: Model) -> float:
    """Return the number of shown states in a unit of the model's time: 240 for a disk, 64 for the DLE."""
    return RATE / clock_of(model)


def times_of(model: Model, count: int) -> Array:
    """Return the times of the shown states."""
    result: Array = np.arange(count) / per_unit(model)
    return result


def columns_of(model: Model) -> list[str]:
    """Return the columns of a run's table: the state, then quantities to draw and plot."""
    return [*model.state_names, page_model(model).drawn, "friction", "friction_work", "effects_work"]


class Grown(NamedTuple):
    """The beginning of a run.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times.
    rows : ndarray, shape (n, columns)
        The columns that `columns_of` names.
    outcome : str
        "running", or why the run ends with the last of these states.
    motor : float
        Power of the motor.
    steps : int
        Steps that the call took.
    """

    t: Array
    rows: Array
    outcome: str
    motor: float
    steps: int


def grown(start: Start, count: int) -> Grown:
    """Run over `count` states and return the first half of them."""
    model = start.model
    run = integrated(model, times_of(model, count), start.state)
    kept_count = count // 2
    most = int(limits.MODEL_SECONDS * RATE)
    outcome = "running"
    if run.outcome != "finished" and len(run.t) <= kept_count:
        outcome, kept_count = run.outcome, len(run.t)
    elif kept_count >= most:
        outcome, kept_count = "full", most
    books = energy_balance(run)
    steps = run.stats.accepted + run.stats.rejected
    return Grown(run.t[:kept_count], _table(run, books, kept_count), outcome, float(books.motor[0]), steps)


class Run:
    """States on a fixed grid of times, as one call of `udd.simulate` over a longer time gives them.

    A call cuts its last step to end at the last time, which changes the last few states by rounding. So only
    the first half of a call's states is used, and the next call repeats them bit by bit. Steps are far
    shorter than half a call, since friction bounds them at about a second.

    The run ends as "spent" if the next call would take more than `limits.STEPS` steps.
    """

    def __init__(self, start: Start) -> None:
        self.start = start
        self.outcome = "running"
        self.motor = 0.0
        self.rows = np.empty((0, 0))
        self.t = np.empty(0)
        self._asked = 0
        self._refused: UddError | None = None

    def lacks(self, count: int) -> int:
        """Return over how many states the next call must run for `count` states; 0 if they are there.

        Raises
        ------
        UddError
            The run could not begin, as an earlier call showed.
        """
        if self._refused is not None:
            raise self._refused
        if self.outcome != "running" or len(self.rows) >= count:
            return 0
        return 2 * self._asked if self._asked else int(_FIRST * RATE)

    def take(self, count: int, grown_run: Grown) -> None:
        """Take over the states that a call over `count` states gave."""
        before, dim = len(self.rows), len(self.start.state)
        if before and not np.array_equal(grown_run.rows[:before, :dim], self.rows[:, :dim]):
            raise AssertionError("a longer run did not repeat a shorter one")
        self._asked = count
        self.t, self.rows = grown_run.t, grown_run.rows
        self.outcome, self.motor = grown_run.outcome, grown_run.motor
        if self.outcome == "running" and 2 * grown_run.steps > limits.STEPS:
            self.outcome = "spent"

    def end(self, refusal: UddError) -> None:
        """End the run where it is, as a call took too much; without states refuse it."""
        if len(self.rows):
            self.outcome = "spent"
        else:
            self._refused = refusal

    def piece(self, first: int, count: int) -> tuple[Array, bool]:
        """States `first` to ``first + count`` (fewer where it ends), and whether the run ends with them."""
        while states := self.lacks(first + count):
            self.take(states, grown(self.start, states))
        last = min(first + count, len(self.rows))
        return self.rows[first:last], self.outcome != "running" and last == len(self.rows)


def _table(run: Trajectory, books: EnergyBalance, count: int) -> Array:
    work = [books.friction, books.work("friction"), books.work("effects")]
    if page_model(run.model).drawn == "beta":
        omega, step = run.state[:, 0], np.diff(run.t)
        turned = np.append(0.0, np.cumsum(0.5 * (omega[1:] + omega[:-1]) * step))  # to draw the mark
        beside = [turned]
    else:
        beside = [angular_momentum(run.model, run.state)]  # type: ignore[arg-type]  # a Disk
    return np.ascontiguousarray(np.column_stack([run.state, *beside, *work])[:count])


class Runs:
    """The last few runs of one page."""

    def __init__(self, most: int = 4) -> None:
        self._most = most
        self._kept: OrderedDict[str, Run] = OrderedDict()

    def of(self, start: Start) -> Run:
        """Return the run from this start."""
        key = key_of(start)
        if key not in self._kept:
            self._kept[key] = Run(start)
        self._kept.move_to_end(key)
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)
        return self._kept[key]


def as_csv(start: Start, seconds: float, shown: bool = False) -> str:
    """Write the states that the page shows as a table.

    Parameters
    ----------
    start : Start
        The model and where the run begins.
    seconds : float
        How long the run is on the page.
    shown : bool
        Write them in the units that the page shows, to ten digits, with these units in the headings. Without
        it they are in SI units, with enough digits to be the same bits.

    Raises
    ------
    ModelError
        More seconds than a run can have.
    """
    if not 0 < seconds <= limits.MODEL_SECONDS:
        raise ModelError(f"seconds must be above 0 and at most {limits.MODEL_SECONDS:g}, not {seconds:g}")
    run = Run(start)
    rows, _ = run.piece(0, round(seconds * RATE) + 1)
    names = start.model.state_names
    lines = [f"# model = {start.model!r}", f"# outcome = {run.outcome}"]
    table = np.column_stack([run.t[: len(rows)], rows[:, : len(names)]])
    if not shown:
        lines += [",".join(("t", *names)), *(",".join(map(repr, row)) for row in table.tolist())]
        return "\n".join(lines) + "\n"
    units = [("s" if start.model.kind == "disk" else "", 1.0)]
    units += [_SHOWN.get(unit, (unit, 1.0)) for unit in start.model.state_units]
    lines += [f"# {text}" for text in _parameters(start.model)]
    lines.append(
        ",".join(_with_unit(name, unit) for name, (unit, _) in zip(("t", *names), units, strict=True))
    )
    table *= [scale for _, scale in units]
    lines += [",".join(f"{value:.10g}" for value in row) for row in table.tolist()]
    return "\n".join(lines) + "\n"


_SHOWN = {"m": ("cm", 100.0)}  # the units of the page's reader


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _parameters(model: Model) -> list[str]:
    """List each parameter with its unit on the page, then the effects."""
    ranges = page_model(model).ranges
    lines = [
        f"{_with_unit(name, unit)} = {model.parameters[name] * scale:.10g}"
        for name, (_, _, _, scale, unit) in ranges.items()
    ]
    return lines + [f"effect = {effect!r}" for effect in getattr(model, "effects", ())]
