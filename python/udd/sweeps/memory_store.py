"""A sweep in memory."""

from __future__ import annotations

import contextlib
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd._util.memory import require_memory

from .chunks import (
    Grid,
    attributes,
    compute,
    coordinate_attributes,
    fill_of,
    part_of,
    spec_attributes,
    variables_of,
)
from .quantities import Found
from .spec import SweepSpec

if TYPE_CHECKING:
    import xarray as xr


class Memory:
    """The arrays of a sweep, filled as chunks come back."""

    work = staticmethod(compute)
    remedy = "the others are kept"

    def __init__(self, spec: SweepSpec, grid: Grid, threads: int) -> None:
        self._spec, self._grid, self._threads = spec, grid, threads
        for v in variables_of(spec):
            shape = (*grid.shape, *(n for _, n in v.dimensions))
            require_memory(
                f"the results of {prod(grid.shape)} runs", *shape, itemsize=np.dtype(v.dtype).itemsize
            )
        self._done = np.zeros(len(grid), dtype=bool)
        self._arrays: Found = {
            v.name: np.full((*grid.shape, *(n for _, n in v.dimensions)), fill_of(v), dtype=v.dtype)
            for v in variables_of(spec)
        }

    def writing(self) -> contextlib.AbstractContextManager[None]:
        """Nothing is written to a disk."""
        return contextlib.nullcontext()

    def arguments(self, chunk: int) -> tuple[Any, ...]:
        """Return the arguments of `work`."""
        return part_of(self._spec, self._grid, chunk), self._threads

    def keep(self, chunk: int, arrays: Found) -> None:
        """Take what `work` gave."""
        for name, values in arrays.items():
            self._arrays[name][self._grid.region(chunk)] = values
        self._done[chunk] = True

    def done(self) -> NDArray[np.bool_]:
        """Return the mask of finished chunks."""
        return self._done

    def tidy(self) -> None:
        """Do nothing: memory needs no cleaning."""

    def close(self) -> None:
        """Do nothing: no other sweep uses the arrays."""

    def dataset(self) -> xr.Dataset:
        """Return the dataset of the finished chunks."""
        import xarray as xr

        spec = self._spec
        data = {
            v.name: ((*spec.over, *(name for name, _ in v.dimensions)), self._arrays[v.name], attributes(v))
            for v in variables_of(spec)
        }
        axes = spec.axes.items()
        coordinates = {name: (name, values, coordinate_attributes(spec, name)) for name, values in axes}
        return xr.Dataset(data, coordinates, spec_attributes(spec))
