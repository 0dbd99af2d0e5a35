"""Random models as text, and the bits of everything that the core computes for them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

import udd
from udd import _core

METHODS = ("dopri5", "dop853", "taylor", "rodas")
#: Operations on one or two values, which replace `{a}` and `{b}`. A model has at most six kinks.
SMOOTH = (
    *("({a} + {b})", "({a} - {b})", "{a}*{b}", "({a} - k*{b})", "{a}*{b}*c", "(c - {a}*{b})", "({a}*k + c)"),
    *(
        "{a}/(2 + {b}^2)",
        "k/(3 + {a}^2)",
        "-{a}",
        "{a}^2",
        "{a}^3",
        "{a}^5",
        "({a}^2 + {b})",
        "1/(1 + {a}^4)",
    ),
    *("sin({a})", "cos({a}*{b})", "tanh({a})", "exp(-{a}^2)", "sqrt(1 + {a}^2)", "ln(2 + {a}^2)"),
    *("sin(t)*{a}", "(t*{a})/(1 + t)", "cosh(tanh({a}))", "(1 + {a}^2)^c"),
)
KINKS = ("abs({a})", "max({a}, {b})", "min({a}, c)", "sign({a})*{b}")
#: No power series follows these.
ABRUPT = ("where({a} > {b}, {a}, {b}*k)", "atan({a})", "atan2({a}, 2 + {b}^2)")


def random_model(rng: np.random.Generator, states: int) -> udd.Model:
    """Return a model whose motion stays bounded: damped states that bounded random laws drive."""
    names = [f"x{i}" for i in range(states)]
    kinks = int(rng.integers(0, 4))
    forms = (*KINKS, *ABRUPT) if rng.random() < 0.2 else KINKS

    def formula(depth: int) -> str:
        nonlocal kinks
        if depth == 0:
            return str(rng.choice([*names, *names, "k", "c", "0.75"]))
        if kinks and rng.random() < 0.2:
            kinks -= 1
            form = str(rng.choice(forms))
        else:
            form = str(rng.choice(SMOOTH))
        return form.format(a=formula(depth - 1), b=formula(int(rng.integers(0, depth))))

    bound = ("sin({})", "tanh({})", "{0}/(1 + ({0})^2)")
    laws = {}
    for name in names:
        law = str(rng.choice(bound)).format(f"({formula(int(rng.integers(1, 4)))})")
        other = rng.choice(names)
        laws[name] = str(
            rng.choice([other, f"{law} - 0.3*{name}", f"k*({law} - {name}) + cos({other})*{name}/4"])
        )
        if laws[name] == other:
            laws[name] = f"{other} - {name}^3"
    return udd.Model(names, laws, {"k": 0.8, "c": 1.3})


def bits(*arrays: Any) -> str:
    """Return a digest of the arrays' bits; a zero's sign counts, and all that are no numbers are the same."""
    digest = hashlib.sha256()
    for array in arrays:
        values = np.array(array, dtype=float)
        values[np.isnan(values)] = np.nan
        digest.update(values.tobytes())
    return digest.hexdigest()


def computed(model: udd.Model, rng: np.random.Generator) -> dict[str, Callable[[], str]]:
    """Return the computations of a model by name, each of which returns the bits of its results."""
    dim = len(model.state_names)
    start = rng.normal(size=dim)
    starts = rng.normal(size=(11, dim))
    end = 4.0
    work: dict[str, Callable[[], str]] = {}
    for method in METHODS:
        for rtol in (1e-6, 1e-10):

            def simulated(method: str = method, rtol: float = rtol) -> str:
                run = udd.simulate(model, np.linspace(0, end, 7), start, method=method, rtol=rtol)
                return bits(run.t, run.state, run.stats.accepted)

            def together(method: str = method, rtol: float = rtol) -> str:
                run = udd.ensemble(model, [0, end / 2, end], starts, method=method, rtol=rtol, threads=1)
                return bits(run.state)

            work[f"simulate {method} {rtol}"] = simulated
            if method != "rodas":
                work[f"ensemble {method} {rtol}"] = together
    work["lyapunov"] = lambda: bits(udd.lyapunov(model, t=60.0, transient=5.0, state0=start, with_error=True))
    work["exponents"] = lambda: bits(
        udd.lyapunov(model, parameters={"k": np.linspace(0.7, 0.9, 9)}, t=20.0, transient=2.0, state0=start)
    )

    def fitted() -> str:
        t = np.linspace(0, 6, 60)
        noise = np.random.default_rng(0).normal(scale=1e-3, size=(len(t), dim))
        seen = udd.simulate(model, t, start).state + noise
        columns = dict(zip(model.state_names, seen.T, strict=True))
        sigma = {name: np.full(len(t), 1e-3) for name in columns}
        fit = udd.fit(udd.Measurement(t, columns, sigma=sigma), model, ["k", "c"])
        return bits(*[[fit.parameters[n], fit.errors[n]] for n in ("k", "c")])

    work["fit"] = fitted
    return work


def outcome(work: Callable[[], str]) -> str:
    """Return what a computation returns, or its error."""
    try:
        return work()
    except Exception as error:
        return f"{type(error).__name__}: {error}"


@contextmanager
def machine_code(when: str) -> Iterator[None]:
    """Make machine code "never" or "always" for a while."""
    _core.make_machine_code(when)
    try:
        yield
    finally:
        _core.make_machine_code("paying")
