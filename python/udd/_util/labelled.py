"""Results as labelled arrays (xarray)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError

if TYPE_CHECKING:
    import xarray as xr


def require_xarray() -> Any:
    """Return xarray, or say in one sentence how to get it."""
    try:
        import xarray
    except ImportError as error:
        raise UddError(
            f"labelled arrays need the extra 'scale' ({error}): pip install 'udd[scale]'"
        ) from None
    return xarray


def dataset(
    columns: Mapping[str, NDArray[Any]],
    dims: Sequence[str],
    units: Mapping[str, str],
    coords: Mapping[str, NDArray[Any]],
    **attrs: Any,
) -> xr.Dataset:
    """Columns of one shape, each with its unit where it has one.

    Raises
    ------
    UddError
        xarray, of the extra ``scale``, is not installed.
    """

    def labelled(
        name: str, values: NDArray[Any], dimensions: Sequence[str]
    ) -> tuple[Sequence[str], NDArray[Any], dict[str, str]]:
        unit = units.get(name, "")
        return dimensions, np.asarray(values), {"units": unit} if unit else {}

    labelled_data: xr.Dataset = require_xarray().Dataset(
        {name: labelled(name, values, dims) for name, values in columns.items()},
        {name: labelled(name, values, [name]) for name, values in coords.items()},
        attrs,
    )
    return labelled_data


def of_states(
    names: Sequence[str],
    units: Sequence[str],
    state: NDArray[np.float64],
    dims: Sequence[str],
    coords: Mapping[str, NDArray[Any]],
    **attrs: str,
) -> xr.Dataset:
    """States, shape (*dims, dim), as a column for each component.

    Raises
    ------
    UddError
        xarray, of the extra ``scale``, is not installed.
    """
    columns = {name: state[..., k] for k, name in enumerate(names)}
    return dataset(columns, dims, dict(zip(names, units, strict=True)), coords, **attrs)


def axes(shape: tuple[int, ...], name: str) -> list[str]:
    """Names of the axes of an array of runs: one is called by the name alone, several are numbered."""
    return [name] if len(shape) == 1 else [f"{name}_{k}" for k in range(len(shape))]
