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
from udd.fitting import Fit, SolveError, at_level, continuous, fit_record, minimise, record_of, solve
from udd.fitting.parameters import Free
from udd.fitting.record import Record
from udd.measurement import Measurement
from udd.models import Model

from .thresholds import ALPHA
from .trial_fits import attempted

_FAR = -6.0  # change of the criterion below which terms are removed several at a time
_EQUAL = 1e-3  # in the criterion
_LOOSE = 1  # schedule level of a fit that a wrong model does not distort
_NEARLY = 3  # steps of a fit that only shows whether a term is worth while
_TRIED = 3  # removed terms that are restored in turn, to see whether another can be removed instead
_HOPELESS = 20.0  # margin in the criterion for the error of a first-order estimate
_ROUNDS = 8  # maximum of such exchanges


@dataclass(frozen=True)
class Pruned:
    """Model with the terms that the data need.

    Attributes
    ----------
    fit : Fit
        Fit with the other terms fixed at zero.
    full : Fit
        Fit with all terms.
    kept, removed : list of str
        Names of the parameters.
    rise : dict of str to float
        For each kept term, the increase in chi2 without it.
    price : float
        Required gain of a parameter, in chi2; with a `spread` in addition to the cost by its prior.
    undetermined : list of str
        Those of `removed` that the data do not determine together with the terms named before them: on the
        orbit they are linear combinations of these, and could replace them. A constant of the motion causes
        such terms.

    See Also
    --------
    udd.prune : makes it.
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
        """The fitted model; removed parameters are zero."""
        return self.fit.model

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON-ready values.

        Returns
        -------
        dict of str
            Numbers, texts, lists and dictionaries; :func:`json.dumps` takes it.
        """
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
    """Eliminate a model's needless terms backward, with exchanges.

    All free parameters are fitted together. The term that matters least is fixed at zero and the rest are
    refitted, as long as the criterion decreases. This is done from a fit with a small model error and from
    one with a large one, and the better end is kept. Then each removed term is restored in turn, to see
    whether another can be removed instead.

    Parameters
    ----------
    measurement : Measurement or sequence of Measurement
    model : Model, or a sequence of them
        Its terms have factors among the parameters; a term with factor zero is absent.
    among : iterable of str, optional
        Parameters that may be removed; default: all free ones.
    free, priors
        As for :func:`udd.fit`.
    spread : float, optional
        Typical size of the factors, in the user's units: the standard deviation of their prior around zero.
        Sets of terms are then compared by their evidence, minus the log count of terms for each of them. If
        two sets explain the data equally well, the one whose factors need less precision wins, usually that
        of the lower powers. By default every term has the same price.
    alpha : float
        Without a `spread`, the probability of keeping a superfluous term, over all of them together.
    progress : bool or callable, optional
        True or None shows the current stage, False nothing. A function is called with it as text.

    Returns
    -------
    Pruned
        `model` is the reduced model; `kept`, `removed` and `rise` say which terms it has and why.

    Raises
    ------
    FitError
        The model cannot be fitted, or a name is not a free parameter.

    See Also
    --------
    discover : find missing terms.

    Examples
    --------
    A swing with every power of its speed up to the third; the true model has only the first.

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
    first_model = model if isinstance(model, Model) else next(iter(model))
    free_names = list(first_model.parameters if free is None else free)
    names = free_names if among is None else list(among)
    for name in names:
        if name not in free_names:
            raise FitError(
                f"{name!r} is not a free parameter of the model; choose from {', '.join(free_names)}"
            )
    if not 0.0 < alpha < 1.0:
        raise FitError(f"alpha must be a probability between 0 and 1, not {alpha!r}")
    if spread is not None:
        if not 0.0 < spread < np.inf:
            raise FitError(f"spread must be above 0 and finite, not {spread!r}")
        priors = dict.fromkeys(names, (0.0, spread)) | dict(priors or {})
    full, undetermined = _determined(measurement, record, model, free_names, names, priors or {})
    if undetermined:
        tell(f"not determined: {', '.join(undetermined)}")
    # About one of n terms is expected to be needed; or each has a price against chance.
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
    """Fit all terms that the data determine together; also name the others.

    If terms can change together without changing the fit, the last one is removed, until none can.
    """
    gone: list[str] = []
    while True:
        remaining = [name for name in free if name not in gone]
        kept_priors = {name: prior for name, prior in priors.items() if name not in gone}
        try:
            return fit_record(
                measurement, record, model, remaining, priors=kept_priors, each=(), search=True
            ), [name for name in names if name in gone]
        except SolveError as error:
            last = [name for name in names if name in error.undetermined]
            if not last:
                raise
            gone.append(last[-1])
            zero = dict.fromkeys(gone, 0.0)
            model = model.replace(**zero) if isinstance(model, Model) else [m.replace(**zero) for m in model]


class _Pruning:
    """Search for the most probable set of terms."""

    def __init__(
        self, names: list[str], price: float, spread: float | None, full: Fit, tell: Callable[[str], object]
    ) -> None:
        self.names, self.price, self.spread, self.full, self.tell = names, price, spread, full, tell
        # One unit for all: in units of its own scatter every chi2 equals its degrees of freedom.
        self.unit = max(full.scatter, 1.0)

    def run(self) -> Fit:
        """Remove terms, reduce the model error and exchange terms.

        Terms are removed twice, from a small and from a large model error. The orders of removal differ, and
        the better end decides between sets of terms that are almost equivalent, as in ODEBench 24.
        """
        ends = []
        for level in dict.fromkeys((self.full.level, min(self.full.level, _LOOSE))):
            # With fewer terms a smaller model error may be possible.
            ends.append(self._tightened(self._without(at_level(self.full, level))))
        level = min(end.level for end in ends)
        current = min(ends, key=lambda end: self.criterion(at_level(end, level)))
        for _ in range(_ROUNDS):
            better = self._exchanged(current)
            if better is None:
                break
            current = better
        return current

    def rises(self, fitted: Fit) -> dict[str, float]:
        """Return the increase in chi2 without each of the kept terms, to first order."""
        return {
            name: (fitted.parameters[name] / fitted.errors[name]) ** 2 / self.unit
            for name in self.names
            if name in fitted.parameters
        }

    def criterion(self, fitted: Fit) -> float:
        """Return the criterion to minimise: chi2 plus the price of the terms, or minus twice the evidence."""
        if self.spread is not None:
            return -2.0 * fitted.evidence + self.price * len(fitted.parameters)
        return fitted.chi2 / self.unit + self.price * len(fitted.parameters)

    def _change(self, fitted: Fit, gone: list[int]) -> float:
        """Return the change of the criterion without some parameters, to first order."""
        a = np.array(list(fitted.parameters.values()))[gone]
        block = fitted.covariance[np.ix_(gone, gone)]
        rise = float(a @ np.linalg.solve(block, a))
        if self.spread is None:
            return rise / self.unit - self.price * len(gone)
        return rise + float(np.linalg.slogdet(block)[1]) - len(gone) * (math.log(self.spread**2) + self.price)

    def _tightened(self, fitted: Fit) -> Fit:
        schedule = fitted.problem.schedule[fitted.level :]
        return solve(fitted.problem, schedule, fitted.point)

    def _without(self, current: Fit, kept: str | None = None) -> Fit:
        """Remove terms except `kept` while the criterion decreases, several at a time if it falls far."""
        needed = set() if kept is None else {kept}
        while True:
            order = [(n, change) for n, change in self._order(current) if n not in needed]
            some = [name for name, change in order if change < _FAR][: max(len(order) // 2, 1)]
            if not some:
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
        """Rank the terms but one in order of removal, with the change of the criterion by each."""
        free = list(fitted.parameters)
        remaining = [free.index(name) for name in self.names if name in fitted.parameters and name != kept]
        gone: list[int] = []
        result, total = [], 0.0
        while remaining:
            changes = [self._change(fitted, [*gone, k]) for k in remaining]
            k = int(np.argmin(changes))
            result.append((free[remaining[k]], changes[k] - total))
            total = changes[k]
            gone.append(remaining.pop(k))
        return result

    def _fixed_at_zero(self, fitted: Fit, gone: Iterable[str]) -> Fit | None:
        """Fit with these parameters fixed at zero, starting at the expected end."""
        gone = list(gone)
        names = list(fitted.parameters)
        out = [names.index(name) for name in gone]
        values = np.array(list(fitted.parameters.values()))
        shift = fitted.covariance[:, out] @ np.linalg.solve(fitted.covariance[np.ix_(out, out)], values[out])
        start = dict(zip(names, (values - shift).tolist(), strict=True)) | dict.fromkeys(gone, 0.0)
        return self._again(fitted, tuple(f for f in fitted.problem.free if f.name not in gone), start)

    def _with(self, fitted: Fit, name: str, amplitude: float) -> Fit | None:
        """Fit with a parameter free that was fixed at zero."""
        free = tuple(f for f in self.full.problem.free if f.name == name or f.name in fitted.parameters)
        return self._again(fitted, free, {name: amplitude}, _NEARLY)

    def _again(
        self, fitted: Fit, free: tuple[Free, ...], start: Mapping[str, float], iterations: int = 40
    ) -> Fit | None:
        shared = (f for f in self.full.problem.free if f.role == "model" and f.film is None)
        placed = {f.index: start[f.name] for f in shared if f.name in start}
        point = fitted.point.with_values(lambda values: [placed.get(k, v) for k, v in enumerate(values)])
        return attempted(minimise, replace(fitted.problem, free=free), point, iterations)

    def _exchanged(self, current: Fit) -> Fit | None:
        """Return a better set of terms, with one restored and others removed; else None."""
        # ODEBench 41 (1 % noise, `spread` = 1): otherwise a wrong set remains.
        fixed = [
            f for f in self.full.problem.free if f.name in self.names and f.name not in current.parameters
        ]
        if not fixed:
            return None
        gradient, information, _alone = _core.score(
            current.problem.at(current.point), [(current.model, [f.index]) for f in fixed]
        )
        diagonal = np.maximum(np.diag(information), 1e-300)
        # With each one in turn, nearly fitted, estimate which terms can be removed.
        wider = [
            (f.name, self._with(current, f.name, g / i))
            for f, g, i in zip(fixed, gradient, diagonal, strict=True)
        ]
        hopes = [
            (self._hope(extended, name), name, extended) for name, extended in wider if extended is not None
        ]
        for hope, name, extended in sorted(hopes, key=lambda h: h[0])[:_TRIED]:
            if hope > self.criterion(current) + _HOPELESS:
                break
            # The restored term would be the first to be removed.
            after = self._tightened(self._without(self._without(extended, kept=name)))
            level = min(after.level, current.level)
            if self.criterion(at_level(after, level)) < self.criterion(at_level(current, level)) - _EQUAL:
                self.tell(f"with {name} again")
                return after
        return None

    def _hope(self, fitted: Fit, kept: str) -> float:
        """Estimate the criterion without the terms that are needless together with one, to first order."""
        total = least = 0.0
        for _name, change in self._order(fitted, kept):
            total += change
            least = min(least, total)
        return self.criterion(fitted) + least
