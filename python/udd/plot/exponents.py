"""Lyapunov exponents: over a parameter, and those of one orbit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd.chaos.spectrum import Covariant, Spectrum
from udd.errors import UddError

from .style import AFTER, FAINT, MEASURED, SHADES, legend_above, new_axes, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_BAND = 1.96  # standard errors of a 95 % band


def exponents(
    result: Any, values: ArrayLike | None = None, ax: Axes | None = None, *, errors: ArrayLike | None = None
) -> Axes:
    """Draw Lyapunov exponents over a parameter, with bands of 95 % if their errors are known.

    Parameters
    ----------
    result : array_like, shape (n,), sequence of Spectrum, or xarray.Dataset
        The parameter's values, such as drives, with the exponents as `values`; the spectra of
        :func:`udd.lyapunov_spectrum` at several values of one parameter; or a sweep of ``"lyapunov"`` or
        ``"spectrum"`` over one parameter, of :func:`udd.sweep`.
    values : array_like, shape (n,) or (n, dim), optional
        Exponents, as :func:`udd.lyapunov` gives them.
    ax : Axes, optional
    errors : array_like, optional
        Standard errors, in the shape of `values`.

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The lengths differ, or `result` holds no exponents over one parameter.

    See Also
    --------
    udd.lyapunov : computes exponents.
    udd.lyapunov_spectrum : computes all exponents of an orbit.
    udd.plot.spectrum : draw a single spectrum.

    Examples
    --------
    >>> import numpy as np, udd
    >>> w = np.linspace(1.0, 8.0, 8)
    >>> udd.plot.exponents(w, udd.lyapunov(w, tol=0.05)).get_xlabel()
    'w [1]'
    """
    if values is not None:
        label, x, y, sd, unit = (
            "w [1]",
            np.asarray(result, dtype=float),
            np.asarray(values, dtype=float),
            errors,
            "1",
        )
    elif hasattr(result, "data_vars"):
        label, x, y, sd, unit = _of_sweep(result)
    else:
        label, x, y, sd, unit = _of_spectra(result)
    if x.ndim != 1 or y.shape[:1] != x.shape or y.ndim > 2:
        raise UddError(f"each value of the parameter needs its exponents, not {y.shape} for {x.shape}")
    y = y.reshape(len(x), -1)
    spread = np.zeros_like(y) if sd is None else _BAND * np.asarray(sd, dtype=float).reshape(y.shape)
    ax = new_axes(ax)
    order = np.argsort(x, kind="stable")
    style: dict[str, Any] = {"marker": "o", "markersize": 3} if len(x) < 60 else {}
    for k in range(y.shape[1]):
        shade = SHADES[k % len(SHADES)]
        name = f"λ{str(k + 1).translate(str.maketrans('0123456789', '₀₁₂₃₄₅₆₇₈₉'))}"
        ax.plot(x[order], y[order, k], color=shade, linewidth=1.3, label=name, **style)
        if sd is not None:
            low, high = y[order, k] - spread[order, k], y[order, k] + spread[order, k]
            ax.fill_between(x[order], low, high, color=shade, alpha=0.25, linewidth=0)
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set_xlabel(label)
    ax.set_ylabel(f"Lyapunov exponent{'s' if y.shape[1] > 1 else ''} [{unit}]")
    if y.shape[1] > 1:
        legend_above(ax)
    tidy(ax)
    return ax


def _of_sweep(result: Any) -> tuple[str, Array, Array, Array, str]:
    """Return the axis, the values, the exponents, their errors and their unit."""
    if not {"value", "standard_error"} <= set(result.data_vars):
        raise UddError('the dataset holds no exponents: udd.sweep computes "lyapunov" and "spectrum"')
    over = [str(name) for name in result["value"].dims if name != "number"]
    if len(over) != 1:
        raise UddError(f"exponents need one parameter, not {', '.join(over)}: select one first")
    axis = result[over[0]]
    label = f"{over[0]} [{axis.attrs.get('units') or '1'}]"
    exponent, error = (result[name].transpose(over[0], ...) for name in ("value", "standard_error"))
    unit = str(exponent.attrs.get("units") or "1")
    return label, axis.to_numpy(), exponent.to_numpy(), error.to_numpy(), unit


def _of_spectra(result: Any) -> tuple[str, Array, Array, Array, str]:
    """Return the axis, values, exponents, errors and unit of several spectra."""
    given = list(result) if isinstance(result, Sequence) else [result]
    if not given or not all(isinstance(spectrum, Spectrum) for spectrum in given):
        raise UddError("exponents need values and exponents, spectra of udd.lyapunov_spectrum, or a sweep")
    settings = [spectrum.model.parameters for spectrum in given]
    first = settings[0]
    varied = [name for name in first if any(other.get(name) != first[name] for other in settings)]
    if len(varied) != 1:
        raise UddError(f"the spectra must differ in one parameter, not in {', '.join(varied) or 'none'}")
    unit = given[0].model.units[varied[0]]
    x = np.array([other[varied[0]] for other in settings])
    y, sd = (
        np.array([getattr(spectrum, name) for spectrum in given]) for name in ("exponents", "standard_errors")
    )
    return f"{varied[0]} [{unit or '1'}]", x, y, sd, given[0].model.profile.dynamics.rate_unit


def spectrum(result: Any, ax: Axes | None = None) -> Axes:
    """Draw the Lyapunov exponents of one orbit, or along it.

    Parameters
    ----------
    result : Spectrum or Covariant
        A spectrum shows each exponent with its 95 % interval. Covariant vectors show the exponents of finite
        time over time, with their means.
    ax : Axes, optional

    Returns
    -------
    Axes

    Raises
    ------
    UddError
        The result is neither.

    See Also
    --------
    udd.lyapunov_spectrum : computes it.
    udd.covariant_vectors : computes exponents along an orbit.
    udd.plot.exponents : draw over a parameter.

    Examples
    --------
    >>> import udd
    >>> udd.plot.spectrum(udd.lyapunov_spectrum(udd.DLE(9.0), t=500.0, tol=0.1)).get_ylabel()
    'Lyapunov exponent [1]'
    """
    if isinstance(result, Covariant):
        return _local(result, new_axes(ax))
    if not isinstance(result, Spectrum):
        raise UddError(f"a spectrum is of udd.lyapunov_spectrum, not {type(result).__name__}")
    ax = new_axes(ax)
    number = np.arange(1, len(result.exponents) + 1)
    there = np.isfinite(result.exponents)
    ax.axhline(0, color="black", linewidth=0.8)
    ax.vlines(number[there], 0, result.exponents[there], color=FAINT, linewidth=2)
    ax.errorbar(
        number[there],
        result.exponents[there],
        _BAND * result.standard_errors[there],
        fmt="o",
        color=AFTER,
        capsize=3,
        label=f"{result.verdict}, Kaplan–Yorke dimension {result.dimension:.3g}",
    )
    ax.set_xticks(number)
    ax.set_xlim(0.5, len(number) + 0.5)
    ax.set_xlabel("number of the exponent [1]")
    ax.set_ylabel(f"Lyapunov exponent [{result.model.profile.dynamics.rate_unit}]")
    legend_above(ax)
    tidy(ax)
    return ax


def _local(result: Covariant, ax: Axes) -> Axes:
    t = 0.5 * (result.t[:-1] + result.t[1:])
    for k, exponents in enumerate(result.local_exponents.T):
        shade = SHADES[k % len(SHADES)]
        ax.plot(
            t,
            exponents,
            color=shade,
            linewidth=0.7,
            alpha=0.7,
            label=f"λ{k + 1}, mean {exponents.mean():.3g}",
        )
        ax.axhline(float(exponents.mean()), color=shade, linewidth=1.4)
    ax.axhline(0, color=MEASURED, linewidth=0.8)
    ax.set_xlabel("time [unit of the model]")
    ax.set_ylabel("exponents of finite time [per unit of time]")
    legend_above(ax)
    tidy(ax)
    return ax
