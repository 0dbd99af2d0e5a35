"""Backward elimination of a model's terms that the data do not need."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from udd import _core
from udd._util import chi_squared
from udd._util.arguments import checked_arguments
from udd._util.progress import Progress, with_status
from udd.errors import FitError
from udd.fitting import Fit, at_level, continuous, fit_record, record_of
from udd.fitting.estimator_input import FilmParameters
from udd.fitting.model_error_schedule import reduce_model_error
from udd.fitting.parameters import Free
from udd.fitting.record import Record
from udd.fitting.solve import SolveError, solve
from udd.measurement import Measurement
from udd.models import Model

#: Chance that a term that is not there is kept, over all terms together.
ALPHA = 1e-3
_FAR = -6.0  # terms that better the criterion by so much by going do so several at a time
_EQUAL = 1e-3  # in the criterion
_LOOSE = 1  # place in the schedule of a fit that a wrong model has not bent
_NEARLY = 3  # steps towards a fit that only has to tell whether it is worth while
_TRIED = 3  # of the terms left out, put back in turn to see whether another can go instead
_HOPELESS = 20.0  # in the criterion, beyond what an estimate to first order may be off
_ROUNDS = 8  # of such exchanges


@dataclass(frozen=True)
class Pruned:
    """A model with the terms that the data need.

    Attributes
    ----------
    fit : Fit
        The others are held at zero.
    full : Fit
        With all of them.
    kept, removed : list of str
        Names of the parameters.
    rise : dict of str to float
        For each that was kept, by how much chi2 would rise without it.
    price : float
        What a parameter has to be worth, in chi2; with a `spread` beside what its prior makes it cost.
    undetermined : list of str
        Those of `removed` that the data do not determine beside the terms named before them: on the orbit
        they are combinations of these, so that they may as well stand in their place. A constant of the
        motion makes such terms.
    """

    fit: Fit
    full: Fit
    kept: list[str]
    removed: list[str]
    rise: dict[str, float]
    price: float
    undetermined: list[str]

    @property
    def model(self) -> Model:
        """The fitted model; parameters that were left out are zero."""
        return self.fit.model

    def to_dict(self) -> dict[str, Any]:
        """What a machine reads."""
        return {
            "kept": {name: {"rise": self.rise[name]} for name in self.kept},
            "removed": self.removed,
            "undetermined": self.undetermined,
            "price": self.price,
            "fit": self.fit.to_dict(),
        }


@checked_arguments(error=FitError)
@with_status
def prune(
    measurement: Measurement | Sequence[Measurement],
    model: Model | Sequence[Model],
    among: Iterable[str] | None = None,
    *,
    free: Iterable[str] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    spread: float | None = None,
    alpha: float = ALPHA,
    progress: Progress = None,
) -> Pruned:
    """Backward elimination of a model's terms, with exchanges.

    All free parameters are fitted together. The term that matters least is fixed at zero and the rest are
    refitted, as long as the criterion falls. This is done from a fit with a small model error and from one
    with a large one; the better end is kept. Then each term that was removed is put back in turn, to see
    whether another can be removed instead.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
    model : Model, or a sequence of them
        Its terms have factors among the parameters; where a factor is zero the term is not there.
    among : iterable of str, optional
        The parameters that may go; by default all that are free.
    free, priors
        As for :func:`udd.fit`.
    spread : float, optional
        How large the factors may well be, in the user's units: the standard deviation of their prior around
        zero. Sets of terms are then compared by their evidence, for each term less the logarithm of their
        number; of two sets that explain the data equally well, that wins whose factors need to be known less
        precisely, mostly that of the lower powers. By default every term is priced alike.
    alpha : float
        Without a `spread`, the chance that a term that is not there is kept, over all of them together.
    progress : bool or callable, optional
        True or None: show what is being done; False: nothing. A function gets it in words.

    Returns
    -------
    Pruned

    Raises
    ------
    FitError
        The model cannot be fitted, or a name is not a free parameter's.

    Examples
    --------
    A swing with every power of its speed up to the third; only the first is there.

    >>> import numpy as np, udd
    >>> t = np.arange(0, 30, 0.05)
    >>> truth = udd.Model(["x", "v"], ["v", "-x - 0.1*v"])
    >>> states = udd.simulate(truth, t, [1.0, 0.0]).state
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal(states.shape)
    >>> swing = udd.Model(["x", "v"], ["v", "-k*x - a*v - b*v^2 - c*v^3"], dict(k=1.0, a=0.0, b=0.0, c=0.0))
    >>> udd.prune(udd.Measurement(t, dict(zip("xv", (states + noise).T))), swing).kept
    ['k', 'a']
    """
    assert callable(progress)
    tell: Callable[[str], object] = progress
    tell("fitting all terms together")
    measurement = continuous(measurement, model)
    record = record_of(measurement, model)
    own = model if isinstance(model, Model) else next(iter(model))
    known = list(own.parameters if free is None else free)
    names = known if among is None else list(among)
    for name in names:
        if name not in known:
            raise FitError(f"{name!r} is not a free parameter of the model; there are {', '.join(known)}")
    if not 0.0 < alpha < 1.0:
        raise FitError(f"alpha is a chance between 0 and 1, not {alpha!r}")
    if spread is not None:
        if not 0.0 < spread < np.inf:
            raise FitError(f"spread must be above 0 and finite, not {spread!r}")
        priors = dict.fromkeys(names, (0.0, spread)) | dict(priors or {})
    full, undetermined = _determined(measurement, record, model, known, names, priors or {})
    if undetermined:
        tell(f"not determined: {', '.join(undetermined)}")
    # Among n terms about one is expected to be needed, or each is priced against chance.
    n = max(len(names), 1)
    price = 2 * math.log(n) if spread is not None else float(chi_squared.isf(alpha / n, 1))
    pruning = _Pruning([name for name in names if name not in undetermined], price, spread, full, tell)
    end = pruning.run()
    kept = [name for name in names if name in end.parameters]
    rise = pruning.rises(end)
    removed = [name for name in names if name not in kept]
    return Pruned(end, full, kept, removed, {n: rise[n] for n in kept}, price, undetermined)


def _determined(
    measurement: Measurement | Sequence[Measurement],
    record: Record,
    model: Model | Sequence[Model],
    free: Sequence[str],
    names: Sequence[str],
    priors: Mapping[str, tuple[float, float]],
) -> tuple[Fit, list[str]]:
    """The fit of all terms that the data determine together, and the names of the others.

    Of terms that can change together without changing the fit the last one goes, until there are none.
    """
    gone: list[str] = []
    while True:
        left = [name for name in free if name not in gone]
        own = {name: prior for name, prior in priors.items() if name not in gone}
        try:
            return fit_record(measurement, record, model, left, priors=own, each=(), search=True), [
                name for name in names if name in gone
            ]
        except SolveError as error:
            last = [name for name in names if name in error.undetermined]
            if not last:
                raise
            gone.append(last[-1])
            zero = dict.fromkeys(gone, 0.0)
            model = model.replace(**zero) if isinstance(model, Model) else [m.replace(**zero) for m in model]


class _Pruning:
    """The search for the likeliest set of terms."""

    def __init__(
        self, names: list[str], price: float, spread: float | None, full: Fit, tell: Callable[[str], object]
    ) -> None:
        self.names, self.price, self.spread, self.full, self.tell = names, price, spread, full, tell
        # One unit for all: divided by its own scatter any chi2 is just the degrees of freedom.
        self.unit = max(full.scatter, 1.0)

    def run(self) -> Fit:
        """Leave out, hold the rest more tightly, exchange; from a tight fit and from a loose one.

        The two leave terms out in another order, and where two sets of terms do nearly the same the order
        decides.
        """
        ends = []
        for level in dict.fromkeys((self.full.level, min(self.full.level, _LOOSE))):
            current, last = at_level(self.full, level), -1
            # Where a model with all its terms cannot be held tightly one with fewer can.
            while current.level > last:
                last = current.level
                current = self._tightened(self._without(current, gently=True))
            ends.append(self._tightened(self._without(current)))
        level = min(end.level for end in ends)
        current = min(ends, key=lambda end: self.criterion(at_level(end, level)))
        for _ in range(_ROUNDS):
            better = self._exchanged(current)
            if better is None:
                break
            current = better
        return current

    def rises(self, fitted: Fit) -> dict[str, float]:
        """By how much chi2 would rise without each of the terms that are left, to first order."""
        return {
            name: (fitted.parameters[name] / fitted.errors[name]) ** 2 / self.unit
            for name in self.names
            if name in fitted.parameters
        }

    def criterion(self, fitted: Fit) -> float:
        """The smaller the better: chi2 with the price of the terms, or minus twice the evidence."""
        if self.spread is not None:
            return -2.0 * fitted.evidence + self.price * len(fitted.parameters)
        return fitted.chi2 / self.unit + self.price * len(fitted.parameters)

    def _change(self, fitted: Fit, gone: list[int]) -> float:
        """By how much the criterion would change without some parameters, to first order."""
        a = np.array(list(fitted.parameters.values()))[gone]
        block = fitted.covariance[np.ix_(gone, gone)]
        rise = float(a @ np.linalg.solve(block, a))
        if self.spread is None:
            return rise / self.unit - self.price * len(gone)
        return rise + float(np.linalg.slogdet(block)[1]) - len(gone) * (math.log(self.spread**2) + self.price)

    def _tightened(self, fitted: Fit) -> Fit:
        schedule = fitted.problem.schedule[fitted.level :]
        return reduce_model_error(fitted.measurements, fitted.problem, fitted.point, schedule)

    def _without(self, current: Fit, gently: bool = False, kept: str | None = None) -> Fit:
        """Leave out terms as long as that is for the better, several at a time while it is by far.

        Gently: only those that hardly matter. One may have to be kept.
        """
        needed = set() if kept is None else {kept}
        while True:
            order = [(n, change) for n, change in self._order(current) if n not in needed]
            some = [name for name, change in order if change < _FAR][: max(len(order) // 2, 1)]
            if not some and not gently:
                some = [name for name, change in order[:1] if change < 0.0]
            if not some:
                return current
            after = self._fixed_at_zero(current, some)
            while len(some) > 1 and not self._better(current, after, _FAR * len(some)):
                some = some[: len(some) // 2]
                after = self._fixed_at_zero(current, some)
            if after is not None and self._better(current, after, 0.0):
                self.tell(f"without {', '.join(some)}")
                current = after
            else:
                needed.update(some)

    def _better(self, before: Fit, after: Fit | None, by: float) -> bool:
        if after is None or not after.converged:
            return False
        return self.criterion(after) - self.criterion(before) < by

    def _order(self, fitted: Fit, kept: str | None = None) -> list[tuple[str, float]]:
        """The terms but one in the order in which they would go, with what each does to the criterion."""
        free = list(fitted.parameters)
        left = [free.index(name) for name in self.names if name in fitted.parameters and name != kept]
        gone: list[int] = []
        result, total = [], 0.0
        while left:
            changes = [self._change(fitted, [*gone, k]) for k in left]
            k = int(np.argmin(changes))
            result.append((free[left[k]], changes[k] - total))
            total = changes[k]
            gone.append(left.pop(k))
        return result

    def _fixed_at_zero(self, fitted: Fit, gone: Iterable[str]) -> Fit | None:
        """The fit with these parameters held at zero, from where it is expected to end."""
        gone = list(gone)
        names = list(fitted.parameters)
        out = [names.index(name) for name in gone]
        values = np.array(list(fitted.parameters.values()))
        shift = fitted.covariance[:, out] @ np.linalg.solve(fitted.covariance[np.ix_(out, out)], values[out])
        start = dict(zip(names, (values - shift).tolist(), strict=True)) | dict.fromkeys(gone, 0.0)
        return self._again(fitted, tuple(f for f in fitted.problem.free if f.name not in gone), start)

    def _with(self, fitted: Fit, name: str, amplitude: float) -> Fit | None:
        """The fit with a parameter free that was held at zero."""
        free = tuple(f for f in self.full.problem.free if f.name == name or f.name in fitted.parameters)
        return self._again(fitted, free, {name: amplitude}, _NEARLY)

    def _again(
        self, fitted: Fit, free: tuple[Free, ...], start: Mapping[str, float], iterations: int = 40
    ) -> Fit | None:
        places = {f.name: f.index for f in self.full.problem.free if f.role == "model" and f.film is None}
        sets = []
        for model, camera, clock in fitted.point.sets:
            values = list(model)
            for name in places.keys() & start.keys():
                values[places[name]] = start[name]
            sets.append(FilmParameters(values, camera, clock))
        problem = replace(fitted.problem, free=free)
        try:
            return solve(
                fitted.measurements, problem, replace(fitted.point.bare(), sets=tuple(sets)), iterations
            )
        except FitError:
            return None

    def _exchanged(self, current: Fit) -> Fit | None:
        """A better set of terms, found by putting one back and leaving out others."""
        fixed = [
            f for f in self.full.problem.free if f.name in self.names and f.name not in current.parameters
        ]
        if not fixed:
            return None
        gradient, information, _alone = _core.score(
            current.problem.at(current.point), [(current.model, [f.index]) for f in fixed]
        )
        own = np.maximum(np.diag(information), 1e-300)
        # With each one in turn, nearly fitted: what could go then?
        wider = [
            (f.name, self._with(current, f.name, g / i)) for f, g, i in zip(fixed, gradient, own, strict=True)
        ]
        hopes = [(self._hope(more, name), name, more) for name, more in wider if more is not None]
        for hope, name, more in sorted(hopes, key=lambda h: h[0])[:_TRIED]:
            if hope > self.criterion(current) + _HOPELESS:
                break
            # The one put back would be the first to go.
            after = self._tightened(self._without(self._without(more, kept=name)))
            level = min(after.level, current.level)
            if self.criterion(at_level(after, level)) < self.criterion(at_level(current, level)) - _EQUAL:
                self.tell(f"with {name} again")
                return after
        return None

    def _hope(self, fitted: Fit, kept: str) -> float:
        """The criterion without the terms that are not needed beside one, to first order."""
        total = least = 0.0
        for _name, change in self._order(fitted, kept):
            total += change
            least = min(least, total)
        return self.criterion(fitted) + least
