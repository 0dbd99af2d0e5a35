"""All equilibria of a model, by Powell's hybrid method from many starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize
from scipy.stats import qmc

from udd._util.keywords import renamed
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


class Equilibria(FoundList[Equilibrium]):
    """The equilibria that a search found."""


@renamed(starts="initial_states")
def equilibria(model: Model, *, near: ArrayLike | None = None, initial_states: int = 128) -> Equilibria:
    """The equilibria of a model.

    Parameters
    ----------
    model : Model
        Its rates must not depend on time.
    near : array_like, shape (dim,) or (n, dim), optional
        States from which the search starts besides those that it chooses itself.
    initial_states : int
        From so many states the search starts, spread over boxes of 0.3 to 10 times the size of the motion.

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
    Each start is refined by Powell's hybrid method with exact derivatives (`scipy.optimize.root`); what
    comes out is kept where nothing moves. The search is not exhaustive: an equilibrium with a small basin of
    that method, or far outside the boxes, can be missed: give a state `near` it. For the DLE the rotating
    states are ``omega = y = +-sqrt(w)``, ``z = 0``; for the disk ``Omega^2 = g W/k(Omega)``, ``Y = W/Omega``,
    where angles that nothing depends on go on turning.

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
    flow = flow_of(model, given if len(given) else np.ones((1, dim)))
    guesses = [*flow.reduced(given)]
    box = qmc.Sobol(flow.dim, seed=3).random(max(whole("initial_states", initial_states, 1), len(_REACHES)))
    for k, reach in enumerate(_REACHES):
        guesses += [*((2.0 * box[k :: len(_REACHES)] - 1.0) * reach * flow.size)]
    found: list[Floats] = []
    for guess in guesses:
        x = refined(flow, flow.values, guess)
        if x is None:
            continue
        for image in (x,) if flow.mirror is None else (x, flow.mirror * x):
            image = image + flow.turns(image)
            if all(_apart(flow, image, known) for known in found):
                found.append(image + 0.0)
    rests = [equilibrium_at(flow, flow.values, x) for x in found]
    rests.sort(key=lambda rest: (rest.eigenvalues[0].real.round(9), *rest.state.round(9)))
    names = [model.state_names[k] for k in flow.kept]
    within = (f"|{n}| <= {_REACHES[-1] * s:.4g}" for n, s in zip(names, flow.size, strict=True))
    given_too = f" and {len(given)} given" if len(given) else ""
    search = f"Powell's method from {len(box)} states within {', '.join(within)}{given_too}: others may exist"
    return Equilibria(rests, search)


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


def refined(flow: FlowMap, values: Floats, guess: Floats) -> Floats | None:
    """The equilibrium that Powell's method finds from a guess, if it is one."""
    unit, model = flow.clock / flow.size, flow.with_values(values)

    def rates(scaled: Floats) -> Floats:
        found = model.rates(0.0, flow.full(scaled * flow.size))[flow.kept]
        scaled_rates: Floats = found * unit
        return scaled_rates

    def slopes(scaled: Floats) -> Floats:
        by_state = expansion(flow, values, scaled * flow.size).by_state
        return by_state * unit[:, None] * flow.size

    with np.errstate(all="ignore"):
        try:
            found = optimize.root(rates, guess / flow.size, jac=slopes, options={"xtol": 1e-14})
        except (ModelError, ValueError):
            return None
        near = np.abs(found.fun).max() < _REST * max(1.0, np.abs(found.x).max())
        regular = near and np.linalg.cond(slopes(found.x)) < 1e12
    return found.x * flow.size if regular else None
