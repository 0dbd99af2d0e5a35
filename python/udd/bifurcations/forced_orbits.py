"""Forced models: the period of the forcing, as a number or a formula of the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.validation import number
from udd.errors import ModelError
from udd.models import Model
from udd.models.formula_model import FormulaModel

__all__ = ["Forcing", "forcing_of", "mirror_of", "repeats", "require_period"]

Floats = NDArray[np.float64]

_SAME = 1e-9  # rates at two times that differ by less, relative to the largest, are the same
_PROBES = 16  # states at which rates are compared
_ASIDE = 1e-3  # a parameter is moved by this part to see whether the period stays


@dataclass(frozen=True, eq=False)
class Forcing:
    """The period after which a law's dependence on time repeats, or a multiple of it.

    Attributes
    ----------
    law : FormulaModel
        One state, whose rate is the period, with the parameters of the forced model.
    """

    law: FormulaModel

    def period(self, values: Floats) -> tuple[float, Floats]:
        """Return the period for these parameters, and its derivatives (p,) by them."""
        law = self.law.with_parameters(dict(zip(self.law.parameters, values.tolist(), strict=True)))
        expansion = _core.expansion(law, 0.0, [0.0], False)
        period = float(expansion["rate"][0])
        if not (np.isfinite(period) and period > 0.0):
            raise ModelError(f"the period {self.law.texts[0]} is {period:g}, not above zero")
        return period, expansion["by_parameter"][:, 0]


def forcing_of(model: Model, period: float | str) -> Forcing:
    """Return the forcing with a period that is a number, or a formula of the model's parameters."""
    text = period if isinstance(period, str) else repr(number("period", period, above=0.0))
    # A point is no part of a name there.
    named = {name: name.replace(".", "__") for name in model.parameters}
    for name in sorted(named, key=len, reverse=True):
        text = text.replace(name, named[name]) if "." in name else text
    state = "period"
    while state in named.values():
        state += "_"
    values = {named[name]: value for name, value in model.parameters.items()}
    try:
        law = FormulaModel([state], [text], values)
    except ModelError as error:
        raise ModelError(f"the period {period!r} cannot be used: {error}") from None
    return Forcing(law)


def repeats(
    model: Model, kept: NDArray[np.intp], size: Floats, after: float, signs: Floats | None = None
) -> bool:
    """Return True if the rates repeat after this time, at states of the sizes (r,) in the components `kept`.

    With `signs` (r,): whether those of states with these signs are, with these signs.
    """
    random, dim = np.random.default_rng(4), len(model.state_names)
    states, turn = np.zeros((_PROBES, dim)), np.ones(dim)
    states[:, kept] = size * random.uniform(-0.9, 0.9, (_PROBES, len(kept)))
    if signs is not None:
        turn[kept] = signs
    t = after * random.uniform(0.0, 3.0, _PROBES)
    if not np.isfinite(model.rates(t, states)).all():
        # Rates may be undefined below zero.
        states, t = np.concatenate([states, np.abs(states)]), np.tile(t, 2)
    now, later = (turn * model.rates(t, states))[:, kept], model.rates(t + after, turn * states)[:, kept]
    defined = np.isfinite(now)
    if not defined.any(axis=0).all() or (defined != np.isfinite(later)).any():
        return False
    now, later = np.where(defined, now, 0.0), np.where(defined, later, 0.0)
    return bool((np.abs(later - now) <= _SAME * np.abs(now).max(axis=0)).all())


def mirror_of(model: Model, kept: NDArray[np.intp], size: Floats, period: float) -> Floats | None:
    """Return the signs (r,) under which the rates half a period later are the same, or None."""
    for signs in product((1.0, -1.0), repeat=len(kept)):
        if min(signs) < 0.0 and repeats(model, kept, size, 0.5 * period, np.array(signs)):
            return np.array(signs)
    return None


def require_period(
    model: Model, forcing: Forcing, kept: NDArray[np.intp], size: Floats, varied: str | None = None
) -> None:
    """Refuse a period that is not that of the forcing, or not where the parameter `varied` is another."""
    if varied is not None:
        value = model.parameters[varied]
        model = model.with_parameters({varied: value + _ASIDE * (abs(value) or 1.0)})
    period, _ = forcing.period(np.array(list(model.parameters.values())))
    if repeats(model, kept, size, period):
        return
    if varied is not None:
        raise ModelError(
            f"the forcing's period depends on {varied}: give it as a formula of the parameters, as in "
            f"periodic_orbit(model, period='2*pi/{varied}')"
        )
    raise ModelError(f"the rates do not repeat after the period {period:.12g}")
