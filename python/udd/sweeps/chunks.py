"""Chunks of a sweep, and the work on a chunk."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, prod

import numpy as np

from udd.models import Model
from udd.simulation.outcomes import OUTCOMES

from .quantities import NOT_RUN, QUANTITIES, Floats, Found, Options, Variable
from .spec import SweepSpec


@dataclass(frozen=True)
class Grid:
    """A sweep's chunks: boxes of equal size (smaller at the far ends) on the grid of its values."""

    shape: tuple[int, ...]
    box: tuple[int, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """The number of chunks along each axis."""
        return tuple(ceil(n / size) for n, size in zip(self.shape, self.box, strict=True))

    def __len__(self) -> int:
        return prod(self.counts)

    def place(self, chunk: int) -> tuple[int, ...]:
        """Return the place of this chunk among the chunks."""
        return tuple(int(k) for k in np.unravel_index(chunk, self.counts))

    def region(self, chunk: int) -> tuple[slice, ...]:
        """Return the chunk's values along each axis."""
        spans = zip(self.place(chunk), self.box, self.shape, strict=True)
        return tuple(slice(k * size, min((k + 1) * size, n)) for k, size, n in spans)


def grid_of(spec: SweepSpec) -> Grid:
    """Return the chunks of a sweep: filled up from the last axis on, and nearly equal along each."""
    room, box = spec.chunk, []
    for n in reversed(spec.shape):
        pieces = ceil(n / min(n, room))
        box.append(ceil(n / pieces))
        room = max(1, room // n)
    return Grid(spec.shape, tuple(reversed(box)))


@dataclass(frozen=True)
class Part:
    """All that the work on a chunk depends on, and no more, so that it travels light."""

    quantity: str
    model: Model
    axes: dict[str, Floats]
    state0: Floats
    options: Options


def part_of(spec: SweepSpec, grid: Grid, chunk: int) -> Part:
    """Return the part of a sweep that is a chunk."""
    spans = zip(spec.axes.items(), grid.region(chunk), strict=True)
    axes = {name: values[span].copy() for (name, values), span in spans}
    return Part(spec.quantity, spec.model, axes, np.asarray(spec.state0), dict(spec.options))


def compute(part: Part, threads: int) -> Found:
    """Compute a chunk: a pure function of its part of the spec, whatever the number of threads."""
    mesh = np.meshgrid(*part.axes.values(), indexing="ij")
    shape = mesh[0].shape
    model = part.model
    rows = np.tile(list(model.parameters.values()), (prod(shape), 1))
    states = np.tile(part.state0, (prod(shape), 1))
    parameters = list(model.parameters)
    for name, values in zip(part.axes, mesh, strict=True):
        if name in parameters:
            rows[:, parameters.index(name)] = values.ravel()
        else:
            states[:, model.state_names.index(name)] = values.ravel()
    arrays = QUANTITIES[part.quantity].run(model, rows, states, part.options, threads)
    return {name: values.reshape(*shape, *values.shape[1:]) for name, values in arrays.items()}


def variables_of(spec: SweepSpec) -> tuple[Variable, ...]:
    """Return the arrays of a sweep's result."""
    outcome = Variable("outcome", "1", "how the trajectory ended", "int8")
    return (*QUANTITIES[spec.quantity].variables(spec.model), outcome)


def attributes(variable: Variable) -> dict[str, object]:
    """Return the attributes of an array, by the CF conventions."""
    if variable.name == "outcome":
        words = " ".join(name.replace(" ", "_") for name in ("not run", *OUTCOMES))
        flags = {"flag_values": list(range(NOT_RUN, len(OUTCOMES))), "flag_meanings": words}
        return {"long_name": variable.meaning, **flags}
    return {"long_name": variable.meaning, "units": variable.unit}


def coordinate_attributes(spec: SweepSpec, name: str) -> dict[str, object]:
    """Return the attributes of an axis, with its unit."""
    units = dict(zip(spec.model.state_names, spec.model.state_units, strict=True)) | spec.model.units
    kind = "parameter" if name in spec.model.parameters else "initial value"
    return {"long_name": f"{kind} {name}", "units": units[name] or "1"}


def spec_attributes(spec: SweepSpec) -> dict[str, object]:
    """Return the attributes with the spec and its hash."""
    return {"quantity": spec.quantity, "spec": spec.to_json(), "spec_sha256": spec.sha256}


def fill_of(variable: Variable) -> float | int | bool:
    """Return the value of an array's entries before they are computed."""
    return {"float64": float("nan"), "int8": NOT_RUN, "bool": False}[variable.dtype]
