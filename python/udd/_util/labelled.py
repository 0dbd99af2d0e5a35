"""Results as labelled arrays (xarray)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr


def dataset(
    columns: Mapping[str, NDArray[Any]],
    dims: Sequence[str],
    units: Mapping[str, str],
    coords: Mapping[str, NDArray[Any]],
    **attrs: str,
) -> xr.Dataset:
    """Columns of one shape, each with its unit where it has one.

    Raises
    ------
    ModuleNotFoundError
        xarray, of the extra ``scale``, is not installed.
    """
    import xarray as xr

    def labelled(
        name: str, values: NDArray[Any], own: Sequence[str]
    ) -> tuple[Sequence[str], Any, dict[str, str]]:
        unit = units.get(name, "")
        return own, np.asarray(values), {"units": unit} if unit else {}

    return xr.Dataset(
        {name: labelled(name, values, dims) for name, values in columns.items()},
        {name: labelled(name, values, [name]) for name, values in coords.items()},
        attrs,
    )


def axes(shape: tuple[int, ...], name: str) -> list[str]:
    """Names of the axes of an array of runs: one is called by the name alone, several are numbered."""
    return [name] if len(shape) == 1 else [f"{name}_{k}" for k in range(len(shape))]
