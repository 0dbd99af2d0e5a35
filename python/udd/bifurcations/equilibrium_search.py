"""All equilibria of a model, by Powell's hybrid method from many starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

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

from .equilibrium_curve import expansion
from .flow_map import Floats, FlowMap, flow_of
from .normal_forms import first_lyapunov_coefficient
from .solutions import Equilibrium, FoundList, kind_of_rest

__all__ = ["Equilibria", "equilibria", "equilibrium_at", "refined"]

_SAME = 1e-7  # two within this part of the typical sizes are one
_REST = 1e-9  # rates, in typical sizes per typical time, that are as good as none
_REACHES = (0.3, 1.0, 3.0, 10.0)  # boxes in which the search starts, in typical sizes
_ROUNDS = 8  # rounds of a search at most
_WIDER = 1.25  # than what was found before is the box of a later round


class Equilibria(FoundList[Equilibrium]):
    """The equilibria that a search found."""


@renamed(starts="initial_states")
@checked_arguments
def equilibria(model: Model, *, near: ArrayLike | None = None, initial_states: int = 128) -> Equilibria:
    """The equilibria of a model.

    Parameters
    ----------
    model : Model
        Its rates must not depend on time.
    near : array_like, shape (dim,) or (n, dim), optional
        States from which the search starts besides those that it chooses itself.
    initial_states : int
        From so many states each round of the search starts, at first spread over boxes of 0.3 to 10 times
        the size of the motion.

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

    Notes
    -----
    Each start is refined by Powell's hybrid method with exact derivatives (`scipy.optimize.root`); the
    result is kept if nothing moves there. Some starts are then refined again with the known equilibria
    divided out of the rates (deflation). If that finds more, the search is repeated from as many states in
    the box that the equilibria span, at most 7 times. The search is not exhaustive: it can miss an
    equilibrium with a small basin of that method, or far outside the boxes: give a state `near` it. For the
    DLE the rotating states are ``omega = y = +-sqrt(w)``, ``z = 0``; for the disk
    ``Omega^2 = g W/k(Omega)``, ``Y = W/Omega``, where angles that nothing depends on go on turning.

    Examples
    --------
    >>> import udd
    >>> for rest in udd.equilibria(udd.DLE(3.0, B=0.2)):
    ...     print(rest.state.round(6) + 0.0, rest.kind)
    [-1.732051 -1.732051  0.      ] saddle-focus
    [1.732051 1.732051 0.      ] saddle-focus
    [0. 0. 5.] saddle

    A search that finds nothing says where it was:

    >>> print(udd.equilibria(udd.Model(["x", "v"], ["v", "1 + x^2"])).search)
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
    found = _search(flow, flow.reduced(given), count)
    rests = [equilibrium_at(flow, flow.values, x) for x in found]
    rests.sort(key=lambda rest: (rest.eigenvalues[0].real.round(9), *rest.state.round(9)))
    names = [model.state_names[k] for k in flow.kept]
    within = (f"|{n}| <= {_REACHES[-1] * s:.4g}" for n, s in zip(names, flow.size, strict=True))
    given_too = f" and {len(given)} given" if len(given) else ""
    search = f"Powell's method from {count} states within {', '.join(within)}{given_too}: others may exist"
    return Equilibria(rests, search)


def _search(flow: FlowMap, given: Floats, count: int) -> list[Floats]:
    """The equilibria found from given states (n, r) and from rounds of `count` states each.

    A round is followed by another in the box of what was found, as long as it finds something new within
    the boxes of the first.
    """
    found: list[Floats] = []

    def add(x: Floats | None) -> bool:
        new = False
        for image in () if x is None else (x,) if flow.mirror is None else (x, flow.mirror * x):
            image = image + flow.turns(image)
            if all(_apart(flow, image, known) for known in found):
                found.append(image + 0.0)
                new = True
        return new

    def inside() -> list[Floats]:
        return [x for x in found if (np.abs(x) <= _REACHES[-1] * flow.size).all()]

    points, guesses = qmc.Sobol(flow.dim, seed=3), [*given]
    for number in range(_ROUNDS):
        box = 2.0 * points.random(count) - 1.0
        if number == 0:
            for k, reach in enumerate(_REACHES):
                guesses += [*(box[k :: len(_REACHES)] * reach * flow.size)]
        else:
            low, high = np.min(inside(), axis=0), np.max(inside(), axis=0)
            guesses = [*(0.5 * (low + high) + box * _WIDER * np.maximum(0.5 * (high - low), flow.size))]
        for guess in guesses:
            add(refined(flow, flow.values, guess))
        before = len(inside())
        for guess in guesses[:: len(_REACHES)]:
            while add(refined(flow, flow.values, guess, found)):
                pass
        if len(inside()) == before:
            break
    return found


def _apart(flow: FlowMap, a: Floats, b: Floats) -> bool:
    """Whether two states differ, by more than whole turns of angles."""
    gap = a - b
    return bool(np.abs((gap + flow.turns(gap)) / flow.size).max() > _SAME)


def equilibrium_at(flow: FlowMap, values: Floats, x: Floats) -> Equilibrium:
    """What there is to say of an equilibrium."""
    here = expansion(flow, values, x, higher=True)
    eigenvalues = np.linalg.eigvals(here.by_state).astype(complex)
    eigenvalues = eigenvalues[np.argsort(-eigenvalues.real, kind="stable")]
    residual = float(np.abs(here.rate * flow.clock / flow.size).max())
    coefficient = first_lyapunov_coefficient(here.by_state, here.second, here.third)
    model = flow.with_values(values)
    return Equilibrium(model, flow.full(x), eigenvalues, kind_of_rest(eigenvalues), residual, coefficient)


def refined(flow: FlowMap, values: Floats, guess: Floats, known: Sequence[Floats] = ()) -> Floats | None:
    """The equilibrium that Powell's method finds from a guess, if it is one.

    Those that are `known` are divided out (deflation), so that the method goes elsewhere. A guess at which
    the rates are undefined is replaced by its absolute values.
    """
    unit, model = flow.clock / flow.size, flow.with_values(values)

    def rates(scaled: Floats) -> Floats:
        found = model.rates(0.0, flow.full(scaled * flow.size))[flow.kept]
        scaled_rates: Floats = found * unit
        return scaled_rates

    def slopes(scaled: Floats) -> Floats:
        by_state = expansion(flow, values, scaled * flow.size).by_state
        return by_state * unit[:, None] * flow.size

    start = guess / flow.size
    with np.errstate(all="ignore"):
        try:
            if not np.isfinite(rates(start)).all():
                start = np.abs(start)
            if len(known):
                deflated, by_state = _deflated(rates, slopes, np.array(known) / flow.size)
                start = optimize.root(deflated, start, jac=by_state).x
            found = optimize.root(rates, start, jac=slopes, options={"xtol": 1e-14})
        except (ModelError, ValueError):
            return None
        near = np.abs(found.fun).max() < _REST * max(1.0, np.abs(found.x).max())
        regular = near and np.linalg.cond(slopes(found.x)) < 1e12
    return found.x * flow.size if regular else None


def _deflated(
    rates: Callable[[Floats], Floats], slopes: Callable[[Floats], Floats], known: Floats
) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
    """Rates that do not vanish at known equilibria (n, r), and their slopes.

    They are multiplied by ``1 + 1/d^2`` for each, with the distance d (P. E. Farrell, A. Birkisson and
    S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026).
    """

    def factor(x: Floats) -> tuple[float, Floats]:
        away = x - known
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
