"""The flow map of a model and its Jacobian, in the coordinates that matter."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd.errors import ModelError
from udd.models import Model, require_model
from udd.models.state_scaling import coordinates_of, depends_on_time

from .forced_orbits import Forcing, mirror_of, require_period

__all__ = ["Floats", "FlowMap", "SegmentEnds", "flow_of"]

Floats = NDArray[np.float64]

_TURN = 2.0 * math.pi
_RTOL, _ATOL = 1e-13, 1e-15  # Tolerances of the runs, relative to states and to the least typical size.
_NOTHING = 1e-100  # a smaller state is 0 but for rounding


@dataclass(frozen=True)
class SegmentEnds:
    """The ends of pieces of orbits.

    States (m, r), derivatives by the starts (m, r, r) and by up to two parameters (m, r, 2), rates (m, r).
    """

    x: Floats
    by_state: Floats
    by_parameter: Floats
    rate: Floats


@dataclass(frozen=True, eq=False)
class FlowMap:
    """A model without the angles that nothing depends on.

    Attributes
    ----------
    model : Model
        Its parameters' values are those of the start; every call brings its own.
    kept : ndarray of int (r,)
        The components of the state on which the rates depend.
    size : ndarray (r,)
        The typical size of each of them.
    clock : float
        A typical time.
    mirror : ndarray (r,) or None
        The signs of the model's symmetry, if it has one; of a forced model's, half a period later.
    forcing : Forcing or None
        The period of the rates where they depend on time.
    """

    model: Model
    kept: NDArray[np.intp]
    size: Floats
    clock: float
    mirror: Floats | None
    forcing: Forcing | None = None
    _made: dict[bytes, Model] = field(default_factory=dict, repr=False)

    @cached_property
    def names(self) -> list[str]:
        """The parameters' names."""
        return list(self.model.parameters)

    @cached_property
    def values(self) -> Floats:
        """The parameters' values."""
        return np.array(list(self.model.parameters.values()))

    @property
    def dim(self) -> int:
        """The number of components kept."""
        return len(self.kept)

    @cached_property
    def _angle(self) -> NDArray[np.bool_]:
        return np.array([self.model.state_names[k] in self.model.angles for k in self.kept])

    def turns(self, gap: Floats) -> Floats:
        """Whole turns of angles that undo gaps (..., r); zero for what is no angle."""
        return np.where(self._angle, -_TURN * np.round(gap / _TURN), 0.0)

    def index(self, parameter: str) -> int:
        """Return the place of a parameter."""
        if parameter not in self.names:
            raise ModelError(
                f"{type(self.model).__name__} has no parameter {parameter!r}; it has {', '.join(self.names)}"
            )
        return self.names.index(parameter)

    def reduced(self, state: Floats) -> Floats:
        """States (..., dim of the model) without the angles left out."""
        return np.ascontiguousarray(np.asarray(state, dtype=np.float64)[..., self.kept])

    def full(self, x: Floats) -> Floats:
        """Reduced states as states of the model: the angles left out are zero."""
        state = np.zeros((*x.shape[:-1], len(self.model.state_names)))
        state[..., self.kept] = x
        return state

    def scaled(self, by_state: Floats) -> Floats:
        """Return a derivative of states by states, shape (..., dim, dim), in units of their typical sizes."""
        result: Floats = by_state * self.size / self.size[:, None]
        return result

    def pieces_for(self, span: float) -> int:
        """Return into how many pieces an orbit of this length is cut."""
        return max(3, math.ceil(2.0 * span / self.clock))

    def fly(
        self,
        values: Floats,
        x: Floats,
        spans: Floats,
        wanted: tuple[int, ...] = (),
        loose: float = 1.0,
        t: Floats | None = None,
    ) -> SegmentEnds:
        """Follow pieces from `x` (m, r), each for its span; `values` (p,) are the parameters of all.

        They begin at the times `t` (m,), by default at 0; `loose` multiplies the tolerances.
        """
        ends = self._shoot(values, x, spans, wanted, loose, t)
        kept = self.kept
        return SegmentEnds(
            ends["x"][:, kept],
            ends["by_state"][:, kept][:, :, kept],
            ends["by_parameter"][:, kept],
            ends["rate"][:, kept],
        )

    def fly_each(self, values: Floats, x: Floats, spans: Floats, loose: float = 1.0) -> Floats:
        """Return the ends of orbits from `x` (m, r); `values` are those of all (p,) or of each (m, p)."""
        return np.ascontiguousarray(self._shoot(values, x, spans, (), loose, None)["x"][:, self.kept])

    def _shoot(
        self,
        values: Floats,
        x: Floats,
        spans: Floats,
        wanted: tuple[int, ...],
        loose: float,
        t: Floats | None,
    ) -> Any:
        rows = np.tile(values, (len(x), 1)) if values.ndim == 1 else values
        begin = np.zeros(len(x)) if t is None else t
        rtol, atol = _RTOL * loose, _ATOL * float(np.min(self.size)) * loose
        return _core.shoot(self.model, rows, self.full(x), begin, spans, list(wanted), rtol, atol)

    def rates(self, values: Floats, x: Floats, t: Floats | float = 0.0) -> Floats:
        """Return the rates (..., r) at reduced states (..., r)."""
        rates: Floats = self.with_values(values).rates(t, self.full(x))[..., self.kept]
        return rates

    @cached_property
    def images(self) -> list[Floats]:
        """Signs (r,) of a state's images: of the state itself and, with a symmetry, of its mirror image."""
        return [np.ones(self.dim)] + ([] if self.mirror is None else [self.mirror])

    def with_values(self, values: Floats) -> Model:
        """Return the model with these parameters; make it once for values that repeat in a row."""
        key = values.tobytes()
        if key not in self._made:
            self._made.clear()
            self._made[key] = self.model.with_parameters(dict(zip(self.names, values.tolist(), strict=True)))
        return self._made[key]


def flow_of(model: Model, states: Floats, forcing: Forcing | None = None) -> FlowMap:
    """Return the flow of a model near these states (n, dim)."""
    require_model(model)
    # A component that happens to be small is no smaller than a tenth of the largest.
    seen = np.maximum(np.abs(states), 0.1 * np.abs(states).max(initial=0.0))
    seen[seen < _NOTHING] = 0.0
    coordinates = coordinates_of(model, seen)
    finite = np.where(np.isfinite(coordinates.size), coordinates.size, 1.0)
    kept = np.flatnonzero(np.isfinite(coordinates.size))
    if depends_on_time(model, finite, 0.7371 * coordinates.clock):
        if forcing is None:
            raise ModelError(
                "the rates depend on time: such a model has no equilibria, and for its cycles the forcing's "
                "period is needed, as in periodic_orbit(model, guess, period='2*pi/w')"
            )
        require_period(model, forcing, kept, finite[kept])
        period, _ = forcing.period(np.array(list(model.parameters.values())))
        mirror = mirror_of(model, kept, finite[kept], period)
        return FlowMap(model, kept, finite[kept], coordinates.clock, mirror, forcing)
    mirror = coordinates.mirrors[0][kept] if coordinates.mirrors else None
    if mirror is not None and (mirror > 0).all():
        mirror = None
    return FlowMap(model, kept, finite[kept], coordinates.clock, mirror)
