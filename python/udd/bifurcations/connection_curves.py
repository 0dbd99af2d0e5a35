"""Homoclinic and heteroclinic orbits over two parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from udd.errors import IntegrationError, ModelError

from .boundary_value import ConnectingCurve
from .branch_continuation import unit_of
from .connecting_orbits import Connection, found_by
from .flow_map import Floats
from .locus_points import LocusPlace, LocusTrace, outside
from .pseudo_arclength import (
    CorrectorFailed,
    CurvePoint,
    newton_corrector,
    predictor_corrector_step,
    tangent_at,
)
from .solution_curve import NO_PARAMETER

__all__ = ["ConnectionWay"]

_SHORTEST = 1e-6  # Shortest step.
_SHAPE = 0.1  # Weight of the orbit's shape in the arclength, relative to that of a parameter.
_FLAT = 5e-3  # Typical sizes between the ends and the equilibria: beyond, an orbit leaves too slowly.
_ON = 1e-9  # Part of a step within which a point lies on the bound.


@dataclass(frozen=True)
class ConnectionWay:
    """Settings for following a curve of connections over two parameters, with bounds (2, 2) of both."""

    parameters: tuple[str, str]
    box: Floats
    step: float
    longest: float
    most: int

    def entered(self, start: Connection) -> Connection:
        """Return the connection where its curve enters the bounds of the second parameter, or `start`."""
        if start._orbit is None:
            raise ModelError("this connection was not made by udd.connection or udd.connections")
        curve, u = start._orbit
        value, (low, high) = float(curve.values_at(u)[curve.flow.index(self.parameters[1])]), self.box[1]
        if low <= value <= high:
            return start
        bound = low if value < low else high
        box = np.array([self.box[0], sorted((value, bound))])
        way = replace(self, box=box)
        trace = way.follow(start, float(np.sign(bound - value)))
        last = trace.places[-1].solution
        if trace.end != f"the bound {bound:.6g}" or not isinstance(last, Connection):
            raise ModelError(f"the curve does not lead into the bounds of {self.parameters[1]}: {trace.end}")
        return last

    def follow(self, start: Connection, sense: float) -> LocusTrace:
        """Return the connections from one inside the bounds on."""
        assert start._orbit is not None
        curve, u = start._orbit
        first, second = (curve.flow.index(name) for name in self.parameters)
        values = curve.values_at(u)
        p = values[[first, second]]
        scales = np.array([unit_of(v, *b) for v, b in zip(p.tolist(), self.box.tolist(), strict=True)])
        weight = _SHAPE / float(np.sqrt(len(curve.nodes(u))))
        curve, u = curve.over((first, second), u, scales, weight)
        trace, step, along = (
            LocusTrace([LocusPlace(p, start)]),
            self.step,
            np.append(np.zeros(len(u) - 1), sense),
        )
        while len(trace.places) <= self.most and not trace.end:
            try:
                curve, here = _cut(curve, u, along)
                there, _, step = predictor_corrector_step(curve, here, step, self.longest, _SHORTEST)
                met = self._bound(curve, here, there)
                if met is not None and met[0] < _ON:
                    trace.end = f"the bound {met[1]:.6g}"
                    break
                trial = self._connection(curve, there.u if met is None else met[3])
            except (CorrectorFailed, ModelError, IntegrationError, np.linalg.LinAlgError) as error:
                trace.end = f"lost: {error}"
                break
            assert trial._orbit is not None
            curve, u = trial._orbit[0].over((first, second), trial._orbit[1], scales, weight)
            along = there.tangent
            values, before = curve.parameters(u), trace.places[-1]
            if met is not None:
                values[met[2]] = met[1]
                trace.end = f"the bound {met[1]:.6g}"
            trace.places.append(LocusPlace(values, trial))
            if met is None and trial.nearest > _FLAT and len(trace.places) > 2:
                trace.end = self._fold_ahead(before, trace.places[-1])
        trace.end = trace.end or "as many points as were wanted"
        return trace

    def _fold_ahead(self, before: LocusPlace, last: LocusPlace) -> str:
        """Return where the slowest eigenvalue vanishes, extrapolated: the orbit's equilibrium folds there."""
        rests = [
            place.solution.equilibrium for place in (before, last) if isinstance(place.solution, Connection)
        ]
        slow = [float(np.abs(rest.eigenvalues.real).min()) for rest in rests]
        part = slow[1] / (slow[0] - slow[1]) if slow[0] > slow[1] else 0.0
        p, q = last.values + part * (last.values - before.values)
        return (
            f"a saddle-node of equilibria near {self.parameters[0]} = {p:.5g}, {self.parameters[1]} = {q:.5g}"
        )

    def _connection(self, curve: ConnectingCurve, u: Floats) -> Connection:
        """Return the connection with its bound, over the first parameter; over the second if that turns."""

        def over(k: int) -> Connection:
            scales = np.array([curve.scales[k], 1.0])
            return found_by(*curve.over((curve.free[k], NO_PARAMETER), u, scales), self.parameters[k])

        try:
            return over(0)
        except ModelError:
            return over(1)

    def _bound(
        self, curve: ConnectingCurve, here: CurvePoint, there: CurvePoint
    ) -> tuple[float, float, int, Floats] | None:
        """Return the part of a step before a bound, the bound, the place of its parameter and the point."""
        before, after = curve.parameters(here.u), curve.parameters(there.u)
        met = [
            ((bound - before[k]) / (after[k] - before[k]), k, bound) for k, bound in outside(after, self.box)
        ]
        if not met:
            return None
        part, k, bound = min(met)
        guess, row = here.u + part * (there.u - here.u), np.zeros(len(here.u))
        row[k - 2] = 1.0
        guess[k - 2] = bound / curve.scales[k]
        return part, bound, k, newton_corrector(curve, guess, row, patience=20)


def _cut(curve: ConnectingCurve, u: Floats, along: Floats) -> tuple[ConnectingCurve, CurvePoint]:
    """Return the curve of orbits cut near their equilibria, and the point there; it leads along a direction.

    Only the direction's equilibria and parameters count, because the cut orbit has other nodes.
    """
    short, v = curve.trimmed(u)
    ahead, same = np.zeros(len(v)), curve.ends * curve.flow.dim + 2
    ahead[-same:] = along[-same:]
    ahead /= np.linalg.norm(ahead)
    short, v = short.solved(v, ahead)
    return short, CurvePoint(v, tangent_at(short, v, ahead))
