"""Inputs of the plots: coordinates over time, by name."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.errors import UddError
from udd.models import DLE, Model
from udd.models.compiled import CompiledModel
from udd.models.profile import ModelProfile
from udd.models.registry import COMPILED

from .style import AXES, label

Array = NDArray[np.float64]

#: The models whose motions are drawn, by the number of their states; of as many the first is meant.
_BY_NUMBER = {len(cls.state_names): cls for cls in reversed(COMPILED.values())}
_OF_A_FIT = ("misfit", "record")


@dataclass(frozen=True)
class Motion:
    """Coordinates over time, in SI units (those of the DLE have none).

    Attributes
    ----------
    title : str
        ``"simulated"``, ``"measured"`` or ``"fitted"``.
    t : ndarray (n,)
    columns : dict of str to ndarray (n,)
    model : Model or None
    radius : float or None
        Radius of the disk, m.
    """

    title: str
    t: Array
    columns: dict[str, Array]
    model: Any
    radius: float | None

    @property
    def profile(self) -> ModelProfile:
        """The profile of the model with these columns."""
        return self._class.profile

    @property
    def states(self) -> tuple[str, ...]:
        """The names of that model's states."""
        return self._class.state_names

    @property
    def time(self) -> str:
        """The label of its time."""
        return "t" if self.is_own else label("t" if self.profile.dynamics.time_unit else "tau")

    @property
    def is_own(self) -> bool:
        """Return True if the columns are states or sensors of the user's own model."""
        written = isinstance(self.model, Model) and self.model.profile.written
        return written or not self._drawn

    @property
    def series(self) -> tuple[str, ...]:
        """The columns that are drawn over time by default, all of one unit."""
        if not self.is_own:
            return self.profile.shown.columns
        names = tuple(self.columns)
        return tuple(name for name in names if self.axis(name)[1] == self.axis(names[0])[1])[:4]

    @property
    def path(self) -> tuple[str, ...]:
        """The columns across and up in an orbit's picture; empty if not known."""
        return tuple(self.columns)[:2] if self.is_own else self.profile.shown.path

    def axis(self, name: str) -> tuple[str, str, float]:
        """Return the words, the unit and the factor of a column."""
        if not self.is_own:
            return AXES[name]
        model = self.model
        named = isinstance(model, Model) and name in model.state_names
        units = dict(zip(model.state_names, model.state_units, strict=True)) if named else {}
        return name, units.get(name) or "1", 1.0

    def label(self, name: str) -> str:
        """Name and unit of a column, as an axis says it."""
        words, unit, _ = self.axis(name)
        return f"{words} [{unit}]"

    @property
    def _class(self) -> type[Model]:
        """The model whose columns these are."""
        drawn = self._drawn
        return next((cls for cls in drawn if isinstance(self.model, cls)), drawn[0] if drawn else DLE)

    @property
    def _drawn(self) -> list[type[Model]]:
        """The models whose last column in pictures is there, or all of whose states are."""
        there = set(self.columns)
        return [c for c in COMPILED.values() if set(c.profile.shown.columns[-1:] or c.state_names) <= there]

    def __getitem__(self, name: str) -> Array:
        try:
            return self.columns[name]
        except KeyError:
            raise UddError(
                f"the {self.title} motion has no {name}; it has {', '.join(self.columns)}"
            ) from None


def require(result: Any, said: str, *attributes: str) -> None:
    """Refuse a result that has not all of these attributes, in a sentence that says what would."""
    if not all(hasattr(result, name) for name in attributes):
        raise UddError(f"{said}, not {type(result).__name__}")


def require_fit(result: Any) -> None:
    """Refuse what is no fit."""
    require(result, "a fit leaves residuals", *_OF_A_FIT)


def is_fit(result: Any) -> bool:
    """Return True if a result is a fit of a model to a measurement."""
    return all(hasattr(result, name) for name in _OF_A_FIT)


def first_film(fit: Any) -> Any:
    """Return the part of a fit that belongs to its first measurement."""
    if len(fit.measurements) == 1:
        return fit
    n = int((fit.record.film == 0).sum())
    record = replace(fit.record.part(slice(0, n)), origins=fit.record.origins[:1])
    return replace(
        fit,
        models=fit.models[:1],
        measurements=fit.measurements[:1],
        record=record,
        states=fit.states[:n],
        state_covariance=fit.state_covariance[:n],
        misfit=fit.misfit[:n],
        misfit_variance=fit.misfit_variance[:n],
        defect=fit.defect[: n - 1],
        noise=replace(fit.noise, weight=fit.noise.weight[:n]),
        point=replace(fit.point.without_cache(), states=fit.point.states[:n], sets=fit.point.sets[:1]),
    )


def motions(result: Any) -> list[Motion]:
    """Return the motions in a trajectory, a measurement or a fit (measured, then fitted; the first film).

    Raises
    ------
    UddError
        The result holds none.
    """
    if is_fit(result):
        result = first_film(result)
        return [measured(result.measurement, result.model), fitted(result)]
    if hasattr(result, "state") and hasattr(result, "t"):
        state = np.asarray(result.state, dtype=np.float64)
        model = getattr(result, "model", None)
        if isinstance(model, Model) and model.profile.written and state.ndim == 2:
            state_columns = dict(zip(model.state_names, state.T, strict=True))
            return [Motion("simulated", np.asarray(result.t), state_columns, model, None)]
        if state.ndim != 2 or state.shape[1] not in _BY_NUMBER:
            raise UddError(f"one trajectory can be drawn, state (time, 2 to 4), not {state.shape}")
        cls = _BY_NUMBER[state.shape[1]]
        if isinstance(model, CompiledModel) and len(type(model).state_names) == state.shape[1]:
            cls = type(model)
        columns = dict(zip(cls.state_names, state.T, strict=True))
        return [Motion("simulated", np.asarray(result.t), columns, model, _radius(model))]
    if hasattr(result, "values") and hasattr(result, "names"):
        return [measured(result, None)]
    raise UddError(f"a trajectory, a measurement or a fit can be drawn, not {type(result).__name__}")


def measured(measurement: Any, model: Any) -> Motion:
    """Return the measured coordinates, NaN where a frame has none."""
    seen = measurement.seen
    columns = {name: np.where(seen, measurement[name], np.nan) for name in measurement.names}
    radius = _radius(model) or (float(measurement.meta["R"]) if "R" in measurement.meta else None)
    return Motion("measured", measurement.t, columns, model, radius)


def fitted(fit: Any) -> Motion:
    """Return the fitted states; a measured coordinate is given as the camera should have seen it.

    So that it lies on the measured one where the fit is good, in spite of the camera's offset and tilt.
    """
    columns = dict(zip(fit.model.state_names, fit.states.T, strict=True))
    for k, name in enumerate(fit.measurement.names):
        columns[name] = fit.record.seen[:, k] - fit.misfit[:, k]
    return Motion("fitted", fit.record.t + fit.record.origin, columns, fit.model, _radius(fit.model))


def only(result: Any) -> Motion:
    """Return the one motion with all states: a trajectory's, or the fitted one."""
    return motions(result)[-1]


def _radius(model: Any) -> float | None:
    value = getattr(model, "R", None)
    return None if value is None else float(value)
