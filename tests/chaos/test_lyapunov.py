"""The largest Lyapunov exponent against reference values, and its promises."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import warnings
from typing import Any

import numpy as np
import pytest

import udd
from udd.errors import ConvergenceWarning, IntegrationError, ModelError


@pytest.mark.parametrize(
    ("w", "wanted", "its_error", "tol"),
    [
        (0.25, 0.0, 0.0, 1e-3),
        (1.0, 0.21016, 7e-5, 8e-4),
        (3.4693, 0.30803, 1.5e-4, 1.5e-3),
        (3.9, 0.21479, 1.9e-4, 2e-3),
        (7.1, 0.0, 0.0, 1e-3),
        (10.0, 0.0, 0.0, 1e-3),
    ],
)
def test_reference_exponents(w: float, wanted: float, its_error: float, tol: float) -> None:
    value, error = udd.lyapunov(w, tol=tol, with_error=True)
    assert error <= tol
    # Within three standard errors, both counted.
    assert abs(value - wanted) < 3 * math.hypot(error, its_error)


def test_the_error_bar_is_honest() -> None:
    """Estimates from many starts scatter about the long-run value as their error bars say."""
    starts = np.random.default_rng(5).normal(size=(40, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        runs = [udd.lyapunov(1.0, t=2000.0, tol=1e-9, state0=x, with_error=True) for x in starts]
    scores = np.array([(value - 0.21016) / error for value, error in runs])
    # A mean of 40 normal scores beyond 4/sqrt(40), or a scatter outside 0.6 to 1.5, has a chance below 1e-4.
    assert abs(scores.mean()) < 4 / math.sqrt(40)
    assert 0.6 < scores.std() < 1.5


@pytest.mark.parametrize("W", [0.071])
def test_exponents_of_the_full_model_vanish_where_it_is_periodic(W: float) -> None:
    value, error = udd.lyapunov(udd.Disk(W, edge="ignore"), with_error=True)
    assert abs(value) < 3 * error + 1e-3


def test_the_full_model_is_chaotic_at_5_5_cm_per_s() -> None:
    value, error = udd.lyapunov(udd.Disk(0.055, edge="ignore"), tol=0.03, with_error=True)
    assert value > 10 * error


def test_a_model_gives_what_its_drive_gives() -> None:
    assert udd.lyapunov(udd.DLE(1.0), tol=1e-2) == udd.lyapunov(1.0, tol=1e-2)


def test_a_damped_pendulum_settles() -> None:
    """Small oscillations decay at k0/(2 inertia), also when the state is long at rest."""
    model = udd.Pendulum(0.5, k0=0.05)
    value, error = udd.lyapunov(model, state0=[0.0, 0.1], t=1000.0, tol=1e-2, with_error=True)
    assert abs(value + 0.05 / (2 * 0.25)) < 2 * error


def test_a_stable_rotation_has_its_eigenvalue() -> None:
    w, b = 5.0, 0.2
    root = w**0.5
    value, error = udd.lyapunov(udd.DLE(w, b), state0=[root, root, 0.0], tol=2e-3, with_error=True)
    roots = np.roots([1, 1 + b * w, w * (1 + b), 2 * w])
    assert roots.real.max() < -0.05
    # A pair: the tangent turns as it shrinks, which leaves a factor of a few over the run.
    assert abs(value - roots.real.max()) < error + 1e-4


def test_arrays_keep_their_shape_and_equal_their_elements() -> None:
    w = np.array([[1.0, 3.9, 10.0], [0.5, 2.0, 5.0]])
    table, errors = udd.lyapunov(w, tol=1e-2, with_error=True)
    assert table.shape == errors.shape == w.shape
    for i in np.ndindex(w.shape):
        assert (table[i], errors[i]) == udd.lyapunov(float(w[i]), tol=1e-2, with_error=True)
    assert isinstance(udd.lyapunov(1.0, tol=1e-2), float)
    assert udd.lyapunov([], tol=1e-2).shape == (0,)


def test_parameters_vary() -> None:
    B, w = np.array([[0.0], [0.2]]), np.array([1.0, 2.0, 3.0])
    options: dict[str, Any] = {"t": 1000.0, "tol": 0.5}
    table, errors = udd.lyapunov(w, parameters={"B": B}, with_error=True, **options)
    assert table.shape == errors.shape == (2, 3)
    assert (udd.lyapunov(udd.DLE(1.0), parameters={"B": B, "w": w}, **options) == table).all()
    for i, j in np.ndindex(table.shape):
        model = udd.DLE(w[j], B[i, 0])
        assert (table[i, j], errors[i, j]) == udd.lyapunov(model, with_error=True, **options)
    assert isinstance(udd.lyapunov(1.0, parameters={"B": 0.2}, **options), float)
    assert udd.lyapunov([], parameters={"B": 0.2}).shape == (0,)


def test_the_same_bits_for_any_number_of_threads() -> None:
    code = "import udd, numpy as np; print(udd.lyapunov(np.linspace(0.5, 4, 9), tol=2e-2).tobytes().hex())"
    runs = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "RAYON_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        ).stdout
        for threads in ("1", "3")
    ]
    assert runs[0] == runs[1] != ""


def test_a_missed_tolerance_warns() -> None:
    with pytest.warns(ConvergenceWarning, match="standard error up to"):
        udd.lyapunov(1.0, t=500.0, tol=1e-6)
    with pytest.warns(ConvergenceWarning, match="2 of 2 exponents"):
        udd.lyapunov([1.0, 2.0], t=500.0, tol=1e-6)
    with pytest.warns(ConvergenceWarning, match="up to inf, above") as said:  # no two blocks
        udd.lyapunov(1.0, t=1.0)
    assert said[0].filename == __file__  # the line of the caller, not one of the package


def test_a_met_tolerance_does_not_warn() -> None:
    """Also where the run was over before anybody looked."""
    _, error = udd.lyapunov(np.arange(1.0, 9.0), t=500.0, tol=1.0, with_error=True)
    assert error.max() < 1.0


def test_an_early_transient_is_left_out() -> None:
    """A start far away spirals in for a time of 1e3 first; the exponent is the attractor's."""
    value, error = udd.lyapunov(1.0, state0=[0.0, 1e-12, -300.0], transient=0.0, tol=2e-3, with_error=True)
    assert abs(value - 0.21016) < 3.5 * error


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: udd.lyapunov(-1.0), "w must not be below 0, not -1"),
        (lambda: udd.lyapunov([1.0, math.nan]), "w must be finite"),
        (lambda: udd.lyapunov("one"), "w must be numbers"),
        (lambda: udd.lyapunov([1.0, 2.0], parameters={"w": 1.0}), "w is given twice"),
        (lambda: udd.lyapunov([1.0, 2.0], parameters={"k0": 1.0}), "DLE has no parameter 'k0'"),
        (lambda: udd.lyapunov([1.0, 2.0], parameters={"B": [0, 0.1, 0.2]}), "do not fit together"),
        (lambda: udd.lyapunov(1.0, t=0.0), "t must be above 0"),
        (lambda: udd.lyapunov(1.0, tol=-1.0), "tol must be above 0"),
        (lambda: udd.lyapunov(1.0, t=10.0, transient=20.0), "transient must be below"),
        (lambda: udd.lyapunov(1.0, state0=[1.0]), "3 components"),
    ],
)
def test_bad_input_gets_one_clear_sentence(call, named) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ModelError, match=named):
        call()


def test_leaving_the_wheels_is_said() -> None:
    with pytest.raises(IntegrationError, match="left the wheels"):
        udd.lyapunov(udd.Disk(0.039))
