"""Orbits from one equilibrium to another as a boundary-value problem, solved by multiple shooting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as linalg_sparse

from udd.errors import ModelError

from .equilibrium_curve import expansion
from .flow_map import Floats, FlowMap
from .pseudo_arclength import CorrectorFailed, natural_constraint, newton_corrector
from .solution_curve import NO_PARAMETER

__all__ = ["ConnectingCurve"]

_LONGER = 4.0  # Time that is added at both ends, in times of the slowest decay.
_LONGEST = 30.0  # The longest such time, in typical times.
_AHEAD = 1e-6  # Scaled difference for derivatives of the conditions at the ends.
_FARTHEST = 0.3  # Largest Newton step, in scaled unknowns.
_PATIENCE = 40  # Number of Newton steps.
_COLLAPSED = 0.1  # Size relative to the guess below which an orbit has collapsed to its equilibrium.
_CUT = 5e-3  # Share of the orbit's extent at which it is cut before it is prolonged.


@dataclass(frozen=True, eq=False)
class SparseEquations:
    """Derivatives (n, n + 1) of which most are zero."""

    matrix: sparse.csr_matrix

    def toarray(self) -> Floats:
        """Return the matrix with its zeros."""
        return np.asarray(self.matrix.toarray())

    def solve(self, row: Floats, right: Floats) -> Floats:
        """Return the unknowns for these right sides, of which the last is that of one more `row`."""
        whole = sparse.vstack([self.matrix, row[np.newaxis]], format="csc")
        try:
            return np.asarray(linalg_sparse.splu(whole).solve(right))
        except RuntimeError as error:
            raise np.linalg.LinAlgError(str(error)) from None


@dataclass(frozen=True, eq=False)
class ConnectingCurve:
    """Scaled nodes of an orbit, the equilibria at its ends, and two parameters.

    The first node lies in the plane of the growing eigenvectors of the first equilibrium, the last node in
    the plane of the decaying ones of the last (W.-J. Beyn, IMA Journal of Numerical Analysis 10 (1990) 379).
    The equilibria are unknowns too: so the curve is smooth near their folds, where they are no functions of
    the parameters. The equations leave one direction free, as those of every curve do.

    Attributes
    ----------
    flow : FlowMap
    values : ndarray
        The model's parameters, of which the two `free` ones are unknowns.
    free : (int, int)
        Their indices; the second one is `NO_PARAMETER` if one parameter alone is varied.
    scales : ndarray, shape (2,)
        The units of both in the unknowns.
    mirror : ndarray, shape (r,)
        Signs: the orbit ends at the mirror image of its last equilibrium.
    span : float
        The time from the first node to the last; all nodes are equally far apart.
    ends : int
        The number of different equilibria, 1 or 2.
    decaying : (int, int)
        The numbers of decaying eigenvectors of the first and the last one.
    planes : (ndarray, ndarray)
        Fixed rows: times projectors these change smoothly with the unknowns.
    reference, across : ndarray, shape (r,)
        The middle node does not move along the flow from the reference.
    weight : float
        The weight of the nodes in the unknowns: the smaller it is, the more the parameters count.
    loose : float
        Multiplies the tolerances of the runs.
    """

    flow: FlowMap
    values: Floats
    free: tuple[int, int]
    scales: Floats
    mirror: Floats
    span: float
    ends: int
    decaying: tuple[int, int]
    planes: tuple[Floats, Floats]
    reference: Floats
    across: Floats
    weight: float = 1.0
    loose: float = 1.0

    @classmethod
    def through(
        cls,
        flow: FlowMap,
        values: Floats,
        parameter: int,
        rests: Floats,
        mirror: Floats,
        nodes: Floats,
        span: float,
    ) -> tuple[ConnectingCurve, Floats]:
        """Return the curve through a guess over one parameter, and the unknowns there.

        `rests` (1 or 2, r) are the equilibria, `nodes` (m + 1, r) the orbit.
        """
        value = float(values[parameter])
        nothing = np.zeros(flow.dim)
        rests = np.atleast_2d(rests)
        growing = [_eigenvalues(flow, values, rest).real > 0.0 for rest in rests]
        decaying = int((~growing[0]).sum()), int((~growing[-1]).sum())
        if decaying[0] != decaying[1]:
            raise ModelError("an orbit between these equilibria is not isolated in one parameter")
        scales, planes = np.array([abs(value) or 1.0, 1.0]), (np.zeros((0, flow.dim)),) * 2
        free = parameter, NO_PARAMETER
        curve = cls(flow, values, free, scales, mirror, span, len(rests), decaying, planes, nothing, nothing)
        u = curve.pack(nodes, rests, values)
        return curve.anchored(u), u

    def pack(self, nodes: Floats, rests: Floats, values: Floats) -> Floats:
        """Unknowns from nodes (m + 1, r), equilibria and all parameters."""
        size, weight = self.flow.size, self.weight
        last = [
            values[k] / scale if k != NO_PARAMETER else 0.0
            for k, scale in zip(self.free, self.scales, strict=True)
        ]
        return np.concatenate([(nodes / size * weight).ravel(), (rests / size).ravel(), last])

    def nodes(self, u: Floats) -> Floats:
        """Return the nodes (m + 1, r)."""
        scaled = u[: -2 - self.ends * self.flow.dim].reshape(-1, self.flow.dim)
        nodes: Floats = scaled * self.flow.size / self.weight
        return nodes

    def rests(self, u: Floats) -> Floats:
        """Return the equilibria (1 or 2, r)."""
        scaled = u[-2 - self.ends * self.flow.dim : -2].reshape(self.ends, -1)
        rests: Floats = scaled * self.flow.size
        return rests

    def parameters(self, u: Floats) -> Floats:
        """Return the values (2,) of the free parameters."""
        pair: Floats = u[-2:] * self.scales
        return pair

    def values_at(self, u: Floats) -> Floats:
        """Return all parameters."""
        values = self.values.copy()
        for index, value in zip(self.free, self.parameters(u).tolist(), strict=True):
            if index != NO_PARAMETER:
                values[index] = value
        return values

    def anchored(self, u: Floats) -> ConnectingCurve:
        """Return the curve with its phase and its planes fixed here."""
        flow, values, nodes, rests = self.flow, self.values_at(u), self.nodes(u), self.rests(u)
        middle = nodes[len(nodes) // 2]
        rate = flow.rates(values, middle) / flow.size
        first, last = (self._projectors(rests[k], values, k)[k] for k in (0, -1))
        begin, end = (np.linalg.svd(p.T)[0][:, : round(float(np.trace(p)))].T for p in (first, last))
        across = rate / np.linalg.norm(rate)
        return replace(self, planes=(begin, end), reference=middle / flow.size, across=across)

    def _projectors(self, rest: Floats, values: Floats, end: int) -> tuple[Floats, Floats]:
        """On the plane of the decaying eigenvectors along that of the growing ones, and the reverse."""
        numbers, right = np.linalg.eig(self.flow.scaled(expansion(self.flow, values, rest).by_state))
        order, count = np.argsort(numbers.real, kind="stable"), self.decaying[end]
        if not 0 < count < len(order):
            raise CorrectorFailed("the equilibrium is no saddle")
        slow = numbers[order[count - 1 : count + 1]]
        if slow[0].imag != 0.0 and slow[0] == slow[1].conjugate():
            raise CorrectorFailed("the equilibrium is no saddle")
        mask = np.isin(np.arange(len(order)), order[:count])
        decaying = ((right * mask) @ np.linalg.inv(right)).real
        return decaying, np.eye(len(order)) - decaying

    def _missed(
        self, rests: Floats, values: Floats, first: Floats, last: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return what the ends, scaled, have of the wrong directions, and the rows of both conditions."""
        size = self.flow.size
        begin = self.planes[0] @ self._projectors(rests[0], values, 0)[0]
        end = self.planes[1] @ self._projectors(rests[-1], values, -1)[1]
        away = self.mirror * last - rests[-1] / size
        return np.concatenate([begin @ (first - rests[0] / size), end @ away]), begin, end

    def equations(self, u: Floats) -> tuple[Floats, SparseEquations]:
        """Return the gaps, the rates at the equilibria, the conditions and the phase, and derivatives."""
        flow, size, r, k = self.flow, self.flow.size, self.flow.dim, self.ends
        nodes, rests, values = self.nodes(u), self.rests(u), self.values_at(u)
        m, weight, x = len(nodes) - 1, self.weight, nodes / size
        wanted = tuple(index for index in self.free if index != NO_PARAMETER)
        runs = flow.fly(values, nodes[:-1], np.full(m, self.span / m), wanted, self.loose)
        n, few = (m + 1) * r, k * r + 2
        # The last rows depend on three nodes alone: the first, the middle and the last.
        rest, by_rest = np.zeros(k * r), np.zeros((k * r, few))
        for j, place in enumerate(rests):
            here, rows, unit = expansion(flow, values, place), slice(j * r, (j + 1) * r), flow.clock / size
            rest[rows] = here.rate * unit
            by_rest[rows, rows] = here.by_state * unit[:, None] * size
            for i, index in enumerate(wanted):
                by_rest[rows, k * r + i] = here.by_parameter[index] * unit * self.scales[i]
        missed, begin, end = self._missed(rests, values, x[0], x[-1])
        by_few = np.zeros((r, few))
        for column in range(k * r + len(wanted)):
            ends = []
            for h in (_AHEAD, -_AHEAD):
                v = u.copy()
                v[n + column] += h
                ends.append(self._missed(self.rests(v), self.values_at(v), x[0], x[-1])[0])
            by_few[:, column] = (ends[0] - ends[1]) / (2.0 * _AHEAD)
        middle = (m + 1) // 2
        phase = self.across @ (x[middle] - self.reference)
        residual = np.concatenate([(runs.x / size - x[1:]).ravel(), rest, missed, [phase]])
        by_parameter = np.zeros((m * r, few))
        for j, scale in enumerate(self.scales[: len(wanted)].tolist()):
            by_parameter[:, k * r + j] = (runs.by_parameter[:, :, j] / size * scale).ravel()
        # Each piece brings two blocks, of the node where it starts and of that where it ends.
        pieces = np.empty((2 * m, r, r))
        pieces[::2], pieces[1::2] = flow.scaled(runs.by_state), -np.eye(r)
        where = np.repeat(np.arange(m), 2)
        where[1::2] += 1
        gaps = sparse.bsr_matrix((pieces / weight, where, np.arange(0, 2 * m + 1, 2)), shape=(m * r, n))
        by_nodes = np.zeros(((k + 1) * r + 1, n))
        by_nodes[k * r : k * r + len(begin), :r] = begin
        by_nodes[k * r + len(begin) : (k + 1) * r, m * r :] = end * self.mirror
        by_nodes[-1, middle * r : middle * r + r] = self.across
        below = np.vstack([by_rest, by_few, np.zeros(few)])
        blocks = [[gaps, by_parameter], [by_nodes / weight, below]]
        return residual, SparseEquations(sparse.bmat(blocks, format="csr"))

    def solved(self, guess: Floats, row: Floats | None = None) -> tuple[ConnectingCurve, Floats]:
        """Return the curve and its point across `row`, by default at the guess of the last parameter."""
        curve = self.anchored(guess)
        across = natural_constraint(guess) if row is None else row
        u = newton_corrector(curve, guess, across, _PATIENCE, _FARTHEST)
        if curve.extent(u) < _COLLAPSED * curve.extent(guess):
            raise CorrectorFailed("the orbit collapses to its equilibrium")
        for k in (0, -1):
            numbers = _eigenvalues(curve.flow, curve.values_at(u), curve.rests(u)[k])
            if int((numbers.real < 0.0).sum()) != curve.decaying[k]:
                raise CorrectorFailed("the equilibrium is no saddle of this kind there")
        return curve, u

    def _gaps(self, u: Floats) -> tuple[Floats, Floats]:
        """Return the gaps of nodes to the first and of images to the last equilibrium, (m + 1, r)."""
        nodes, rests = self.nodes(u), self.rests(u)
        return (nodes - rests[0]) / self.flow.size, (self.mirror * nodes - rests[-1]) / self.flow.size

    def extent(self, u: Floats) -> float:
        """Return the largest distance of the orbit from its first equilibrium, in typical sizes."""
        return float(np.linalg.norm(self._gaps(u)[0], axis=1).max())

    def nearest(self, u: Floats) -> float:
        """Return the larger distance of the two ends from their equilibria, in typical sizes."""
        first, last = self._gaps(u)
        return max(float(np.linalg.norm(first[0])), float(np.linalg.norm(last[-1])))

    def prolonged(self, u: Floats) -> tuple[ConnectingCurve, Floats]:
        """Return the curve of longer orbits, with what the linear flow adds near the equilibria."""
        flow, size, nodes, rests = self.flow, self.flow.size, self.nodes(u), self.rests(u)
        values, share = self.values_at(u), self.span / (len(nodes) - 1)
        away, back = self._gaps(u)
        # Backward in time from the first node, forward from the last.
        ends = ((rests[0], away[0], 0, -1.0), (rests[-1], back[-1], -1, 1.0))
        added = []
        for rest, gap, place, sense in ends:
            matrix = sense * flow.scaled(expansion(flow, values, rest).by_state)
            kept = self._projectors(rest, values, place)[1 + place] @ gap
            # The slowest eigenvalue that decays says how long it takes to come nearer.
            rates = np.linalg.eigvals(matrix).real
            slowest = float(np.abs(rates[rates < 0.0]).min(initial=np.inf))
            time = min(_LONGER / slowest, _LONGEST * flow.clock)
            step, states = linalg.expm(share * matrix), [kept]
            for _ in range(max(1, int(np.ceil(time / share)))):
                states.append(step @ states[-1])
            added.append(rest + size * np.array(states[1:]))
        longer = np.vstack([added[0][::-1], nodes, self.mirror * added[1]])
        return replace(self, span=share * (len(longer) - 1)), self.pack(longer, rests, values)

    def trimmed(self, u: Floats) -> tuple[ConnectingCurve, Floats]:
        """Return the curve of shorter orbits, without what lies near the equilibria at the ends."""
        nodes, near = self.nodes(u), _CUT * self.extent(u)
        first, last = (np.linalg.norm(gap, axis=1) > near for gap in self._gaps(u))
        begin, end = max(int(np.argmax(first)) - 1, 0), len(last) - max(int(np.argmax(last[::-1])) - 1, 0)
        short = nodes[begin:end]
        span = self.span * (len(short) - 1) / (len(nodes) - 1)
        return replace(self, span=span), self.pack(short, self.rests(u), self.values_at(u))

    def over(
        self, free: tuple[int, int], u: Floats, scales: Floats, weight: float = 1.0
    ) -> tuple[ConnectingCurve, Floats]:
        """Return the curve over other parameters, in these units, and the unknowns there."""
        values = self.values_at(u)
        curve = replace(self, values=values, free=free, scales=scales, weight=weight)
        return curve, curve.pack(self.nodes(u), self.rests(u), values)


def _eigenvalues(flow: FlowMap, values: Floats, rest: Floats) -> np.ndarray:
    """Return the eigenvalues (r,) of an equilibrium, largest real part first."""
    numbers = np.linalg.eigvals(expansion(flow, values, rest).by_state).astype(complex)
    return numbers[np.argsort(-numbers.real, kind="stable")]
