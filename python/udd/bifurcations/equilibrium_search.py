"""Equilibria of a model: all isolated ones of polynomial laws, else those that a search finds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize
from scipy.stats import qmc

from udd._util.arguments import checked_arguments
from udd._util.keywords import renamed
from udd._util.memory import require_memory
from udd._util.validation import array, whole
from udd.errors import ModelError
from udd.models import Model, require_model

from .degenerate_roots import Law, degenerate_root
from .equilibrium_curve import equilibrium_at, expansion
from .flow_map import Floats, FlowMap, flow_of
from .homotopy import bezout_number, complex_roots
from .polynomials import Polynomials, numerators_of, taylor_at
from .solutions import Equilibrium, FoundList

__all__ = ["Equilibria", "equilibria", "refined"]

_SAME = 1e-7  # Distance of two results for one equilibrium, in typical sizes.
_REST = 1e-9  # Rates, in typical sizes per typical time, that are zero.
_REACHES = (0.3, 1.0, 3.0, 10.0)  # Boxes in which the search starts, in typical sizes.
_ROUNDS = 8  # Largest number of rounds of a search.
_WIDER = 1.25  # Size of a later box, relative to the extent of the equilibria.
_ROUNDING = 1e-13  # Component, relative to the typical size, that may be rounding.
_MOST_PATHS = 600  # Largest number of paths of a homotopy: some seconds.
_REAL = 1e-8  # Relative imaginary part of a real root.
_EXACT = 1e-6  # Distance from singular derivatives, in typical sizes, of a degenerate equilibrium.
_CLEAR = 1e-3  # Least singular value beyond which an equilibrium is not degenerate.
_ONE = 1e-2  # Distance of singular states that come from one equilibrium, in typical sizes.
_MOST_SINGULAR = 16  # Largest number of singular states that are refined.


class Equilibria(FoundList[Equilibrium]):
    """The equilibria that a search found."""


@renamed(starts="initial_states")
@checked_arguments
def equilibria(model: Model, *, near: ArrayLike | None = None, initial_states: int = 128) -> Equilibria:
    """Find the equilibria of a model.

    Parameters
    ----------
    model : Model
        Its rates must not depend on time.
    near : array_like, shape (dim,) or (n, dim), optional
        States from which the search starts besides those that it chooses itself.
    initial_states : int
        From so many states each round of the search starts, at first spread over boxes of 0.3 to 10 times
        the size of the motion. Not needed for laws of polynomials.

    Returns
    -------
    Equilibria
        A list of :class:`Equilibrium`, the most stable first; its ``search`` says where and how they were
        searched for. Those of a model with a symmetry come in mirror images, or are their own;
        those that differ by whole turns of an angle come once, within half a turn of 0.

    Raises
    ------
    ModelError
        A model whose rates depend on time.

    See Also
    --------
    udd.continuation : follows one over a parameter.
    udd.plot.eigenvalues : draw the eigenvalues.

    Notes
    -----
    If the rates are polynomials, or quotients of polynomials, a homotopy follows as many paths as the
    product of their degrees, the Bezout number, which end in all isolated equilibria (up to 600 paths). A
    multiple root is refined by deflation. A curve or surface of equilibria is represented by a point or two:
    those at the states given as `near`, and those nearest to the origin.

    For other laws each start is refined by Powell's hybrid method with exact derivatives
    (`scipy.optimize.root`); the result is kept if nothing moves there. Some starts are then refined again
    with the known equilibria divided out of the rates (deflation). If that finds more, the search is repeated
    from as many states in the box that the equilibria span, at most 7 times. This search is not exhaustive.
    It can miss an equilibrium with a small basin of that method, or far outside the boxes: give a state
    `near` it. For the DLE the rotating states are ``omega = y = +-sqrt(w)``, ``z = 0``; for the disk
    ``Omega^2 = g W/k(Omega)``, ``Y = W/Omega``, where angles that nothing depends on go on turning.

    Examples
    --------
    >>> import udd
    >>> for rest in udd.equilibria(udd.DLE(3.0, B=0.2)):
    ...     print(rest.state.round(6) + 0.0, rest.kind)
    [-1.732051 -1.732051  0.      ] saddle-focus
    [1.732051 1.732051 0.      ] saddle-focus
    [0. 0. 5.] saddle

    The list says how it was made:

    >>> print(udd.equilibria(udd.Model(["x", "v"], ["v", "1 + x^2"])).search)
    all isolated equilibria: a homotopy with 2 paths, the Bezout number
    >>> print(udd.equilibria(udd.Model(["x", "v"], ["v", "exp(x)"])).search)
    Powell's method from 128 states within |x| <= 10, |v| <= 10: others may exist
    """
    require_model(model)
    dim = len(model.state_names)
    given = np.zeros((0, dim)) if near is None else np.atleast_2d(array("near", near))
    if given.ndim != 2 or given.shape[1] != dim:
        raise ModelError(f"near must be states of {dim} components, not of shape {given.shape}")
    count = max(whole("initial_states", initial_states, 1), len(_REACHES))
    require_memory(f"{count} initial states", count, 200 + 32 * dim, itemsize=1)
    flow = flow_of(model, given if len(given) else np.ones((1, dim)))
    collected = _Found(flow)
    search = _all_of_polynomials(flow, collected) or _search(flow, flow.reduced(given), count, collected)
    for x in flow.reduced(given):
        if refined(flow, flow.values, x) is None:
            collected.add_degenerate(x, nearest=False)
    rests = [equilibrium_at(flow, flow.values, x) for x in collected.regular]
    for x, isolated in collected.degenerate:
        kind = "degenerate" if isolated else "not isolated"
        rests.append(replace(equilibrium_at(flow, flow.values, x), kind=kind, isolated=isolated))
    rests.sort(key=lambda rest: (rest.eigenvalues[0].real.round(9), *rest.state.round(9)))
    sets = sum(not rest.isolated for rest in rests)
    if sets:
        search += f"; {sets} of the list not isolated, on a curve or surface of equilibria"
    return Equilibria(rests, search)


class _Found:
    """Reduced states of equilibria: regular ones, and degenerate ones with whether they are isolated."""

    def __init__(self, flow: FlowMap) -> None:
        self.flow = flow
        self.regular: list[Floats] = []
        self.degenerate: list[tuple[Floats, bool]] = []
        self.law = _law_of(flow)

    def add(self, x: Floats | None) -> bool:
        """Note a regular equilibrium and its mirror image; whether it is new."""
        new = False
        for image in self._images(x):
            if self._is_new(image):
                self.regular.append(image)
                new = True
        return new

    def add_degenerate(self, x: Floats, nearest: bool = True) -> None:
        """Note the degenerate equilibrium near a state, if there is one."""
        size = self.flow.size
        try:
            root = degenerate_root(self.law, x / size, nearest)
        except (ModelError, ValueError, np.linalg.LinAlgError):
            return
        if root is None:
            return
        for image in self._images(root[0] * size):
            if self._is_new(image):
                self.degenerate.append((image, root[1]))

    def _images(self, x: Floats | None) -> list[Floats]:
        flow, images = self.flow, []
        for image in [] if x is None else [signs * x for signs in flow.images]:
            images.append(_without_rounding(flow, image + flow.turns(image)))
        return images

    def _is_new(self, x: Floats) -> bool:
        known = [*self.regular, *(y for y, _ in self.degenerate)]
        return all(_differ(self.flow, x, other) for other in known)


def _without_rounding(flow: FlowMap, x: Floats) -> Floats:
    """Return the state with components that are nothing but rounding replaced by 0."""
    small = np.abs(x) < _ROUNDING * flow.size
    if not small.any() or (x[small] == 0.0).all():
        return x + 0.0
    zero = np.where(small, 0.0, x)
    before, after = (np.abs(flow.rates(flow.values, y)) for y in (x, zero))
    rounding = _ROUNDING * np.abs(expansion(flow, flow.values, x).by_state) @ flow.size
    return zero if (after <= before + rounding).all() else x + 0.0


def _law_of(flow: FlowMap) -> Law:
    """Scaled rates about a scaled state, as polynomials of the scaled distance from it."""
    exact = numerators_of(flow)
    if exact is not None and (exact[1].degrees == 0).all():
        system = exact[0].scaled(flow.size)
        return system.shifted
    unit = flow.clock / flow.size

    def law(y: Floats) -> Polynomials:
        own = taylor_at(flow, flow.values, y * flow.size)
        table = own.coefficients * unit[:, None] * np.prod(flow.size**own.exponents, axis=1)
        return Polynomials(own.exponents, table)

    return law


def _all_of_polynomials(flow: FlowMap, collected: _Found) -> str:
    """Find all isolated equilibria of a law of polynomials or their quotients; say how, or "" for others."""
    fractions = numerators_of(flow)
    if fractions is None:
        return ""
    system = fractions[0].scaled(flow.size)
    paths = bezout_number(system)
    if not 1 <= paths <= _MOST_PATHS or flow.dim == 0:
        return ""
    roots = complex_roots(system)
    if roots.lost:
        return ""
    for root in roots.simple:
        if np.abs(root.imag).max() < _REAL * (1.0 + np.abs(root).max()):
            x = root.real * flow.size
            if _defined(fractions[1], x):
                collected.add(refined(flow, flow.values, x))
    for end in roots.multiple:
        if _defined(fractions[1], end.real * flow.size):
            collected.add_degenerate(end.real * flow.size)
    return f"all isolated equilibria: a homotopy with {paths} paths, the Bezout number"


def _defined(below: Polynomials, x: Floats) -> bool:
    """Return True if no denominator vanishes at a state."""
    return bool((np.abs(below.values(x)) > _REST * below.sizes(x)).all())


def _search(flow: FlowMap, given: Floats, count: int, collected: _Found) -> str:
    """Find equilibria from given states (n, r) and from rounds of `count` states each; say how.

    A round is followed by another in the box of what was found, as long as it finds something new within
    the boxes of the first.
    """

    def inside() -> list[Floats]:
        return [x for x in collected.regular if _within(flow, x)]

    points, guesses = qmc.Sobol(flow.dim, seed=3), [*given]
    singular: list[Floats] = []
    for number in range(_ROUNDS):
        box = 2.0 * points.random(count) - 1.0
        if number == 0:
            for k, reach in enumerate(_REACHES):
                guesses += [*(box[k :: len(_REACHES)] * reach * flow.size)]
        else:
            low, high = np.min(inside(), axis=0), np.max(inside(), axis=0)
            guesses = [*(0.5 * (low + high) + box * _WIDER * np.maximum(0.5 * (high - low), flow.size))]
        for guess in guesses:
            x, regular = _rest_from(flow, flow.values, guess)
            if regular:
                collected.add(x)
            elif (
                x is not None
                and _within(flow, x)
                and all(np.abs((x - y) / flow.size).max() > _ONE for y in singular)
            ):
                singular.append(x)
        before = len(inside())
        for guess in guesses[:: len(_REACHES)]:
            while collected.add(refined(flow, flow.values, guess, collected.regular)):
                pass
        if len(inside()) == before:
            break
    for x in singular[:_MOST_SINGULAR]:
        collected.add_degenerate(x)
    names = [flow.model.state_names[k] for k in flow.kept]
    within = (f"|{n}| <= {_REACHES[-1] * s:.4g}" for n, s in zip(names, flow.size, strict=True))
    given_too = f" and {len(given)} given" if len(given) else ""
    return f"Powell's method from {count} states within {', '.join(within)}{given_too}: others may exist"


def _within(flow: FlowMap, x: Floats) -> bool:
    """Return True if a state lies within the largest box of the search."""
    return bool((np.abs(x) <= _REACHES[-1] * flow.size).all())


def _differ(flow: FlowMap, a: Floats, b: Floats) -> bool:
    """Return True if two states differ by more than whole turns of angles."""
    gap = a - b
    return bool(np.abs((gap + flow.turns(gap)) / flow.size).max() > _SAME)


def refined(flow: FlowMap, values: Floats, guess: Floats, divided: Sequence[Floats] = ()) -> Floats | None:
    """Return the regular equilibrium that Powell's method finds from a guess, or None.

    Those that are `known` are divided out (deflation), so that the method goes elsewhere. A guess at which
    the rates are undefined is replaced by its absolute values.
    """
    x, regular = _rest_from(flow, values, guess, divided)
    return x if regular else None


def _rest_from(
    flow: FlowMap, values: Floats, guess: Floats, divided: Sequence[Floats] = ()
) -> tuple[Floats | None, bool]:
    """Return the state at which Powell's method finds no rates, and True if it is regular."""
    unit = flow.clock / flow.size

    def rates(scaled: Floats) -> Floats:
        return flow.rates(values, scaled * flow.size) * unit

    def slopes(scaled: Floats) -> Floats:
        by_state = expansion(flow, values, scaled * flow.size).by_state
        return by_state * unit[:, None] * flow.size

    start = guess / flow.size
    with np.errstate(all="ignore"):
        try:
            if not np.isfinite(rates(start)).all():
                start = np.abs(start)
            if len(divided):
                deflated, by_state = _deflated(rates, slopes, np.array(divided) / flow.size)
                start = optimize.root(deflated, start, jac=by_state).x
            result = optimize.root(rates, start, jac=slopes, options={"xtol": 1e-14})
        except (ModelError, ValueError):
            return None, False
        if not np.abs(result.fun).max() < _REST * max(1.0, np.abs(result.x).max()):
            return None, False
        matrix = slopes(result.x)
        regular = bool(np.linalg.cond(matrix) < 1e12)
        if regular:
            # Near a multiple root rates are small too.
            regular = _margin(flow, values, result.x, matrix) > _EXACT * max(1.0, np.abs(result.x).max())
    return result.x * flow.size, regular


def _margin(flow: FlowMap, values: Floats, scaled: Floats, matrix: Floats) -> float:
    """About how far from a scaled state the derivatives of the rates become singular, in typical sizes."""
    least = float(np.linalg.svd(matrix, compute_uv=False)[-1])
    if least > _CLEAR:
        return np.inf
    second = expansion(flow, values, scaled * flow.size, higher=True).second
    bend = second * (flow.clock / flow.size)[:, None, None] * flow.size[:, None] * flow.size
    return least / max(float(np.abs(bend).max()), 1e-300)


def _deflated(
    rates: Callable[[Floats], Floats], slopes: Callable[[Floats], Floats], divided: Floats
) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
    """Rates that do not vanish at known equilibria (n, r), and their slopes.

    They are multiplied by ``1 + 1/d^2`` for each, with the distance d (P. E. Farrell, A. Birkisson and
    S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026).
    """

    def factor(x: Floats) -> tuple[float, Floats]:
        away = x - divided
        squared = (away**2).sum(axis=1)
        value = np.prod(1.0 + 1.0 / squared)
        slope: Floats = -2.0 * value * (away / (squared * (1.0 + squared))[:, None]).sum(axis=0)
        return float(value), slope

    def deflated(x: Floats) -> Floats:
        return rates(x) * factor(x)[0]

    def by_state(x: Floats) -> Floats:
        value, slope = factor(x)
        return slopes(x) * value + np.outer(rates(x), slope)

    return deflated, by_state
