"""Table of the function that draws each kind of result."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .attractors import basins, bifurcation
from .branches import branches, diagram
from .crossings import poincare
from .curves import curve
from .evidence import errors
from .exponents import exponents, spectrum
from .forecast_fan import forecast
from .motion import time_series
from .solutions import bias, cascade, cycle, eigenvalues, energy, ensemble, input_signal, lifetimes, locus

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: By the name of the class: its module need not be imported for a picture of another.
BY_KIND: dict[str, Callable[..., Axes]] = {
    "Trajectory": time_series,
    "Measurement": time_series,
    "Fit": time_series,
    "Film": lambda film, ax, **options: time_series(film.truth, ax, **options),
    "Ensemble": ensemble,
    "Section": poincare,
    "Spectrum": spectrum,
    "Covariant": spectrum,
    "Forecast": forecast,
    "Discovery": errors,
    "Curve": curve,
    "Branch": branches,
    "Diagram": diagram,
    "BifurcationPoint": lambda point, ax, **options: draw(point.solution, ax, **options),
    "PeriodicOrbit": cycle,
    "Connection": cycle,
    "CycleConnection": cycle,
    "Crisis": cycle,
    "Equilibrium": eigenvalues,
    "Locus": locus,
    "Cascade": cascade,
    "Lifetimes": lifetimes,
    "EnergyBalance": energy,
    "InputSignal": input_signal,
    "InputBias": bias,
}


def draw(result: Any, ax: Axes | None = None, **options: Any) -> Axes:
    """Draw any result with the function for its kind, like the `plot` of the result.

    Parameters
    ----------
    result : object
        Result of a function of the package, such as the dataset of :func:`udd.bifurcation` or
        :func:`udd.basins`.
    ax : Axes, optional
    **options
        Options of the function that draws it.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        No picture is made for such a result.

    See Also
    --------
    udd.plot : the functions by name.

    Examples
    --------
    >>> import udd
    >>> udd.simulate(udd.DLE(1.0), 5.0, [1, 1, 0.01]).plot().get_xlabel()
    'time t [1]'
    """
    for kind in type(result).__mro__:
        if kind.__name__ in BY_KIND and kind.__module__.startswith("udd."):
            return BY_KIND[kind.__name__](result, ax=ax, **options)
    if hasattr(result, "data_vars"):
        return _of_dataset(result)(result, ax=ax, **options)
    raise UddError(f"no picture is made for {type(result).__name__}; it is made for {', '.join(BY_KIND)}")


def _of_dataset(dataset: Any) -> Callable[..., Axes]:
    """Return the function that draws a dataset."""
    if "grid" in dataset.attrs and "attractor" in dataset:
        return basins
    if "parameter" in dataset.attrs and "point" in dataset.dims:
        return bifurcation
    return exponents
