"""The energy balance: closed forms, and balance against the energy that is stored."""

from __future__ import annotations

import numpy as np
import pytest

import udd


def test_the_disks_friction_is_the_papers_law() -> None:
    model = udd.Disk(0.03)
    run = udd.simulate(model, np.arange(0, 20, 1e-3), [0, 0.001, 0.04, 0])
    books = udd.energy_balance(run)
    speed = np.abs(run.Omega)
    k = np.maximum(model.k1 - model.k2 * speed, model.k0)
    # Rounding: the same numbers in another order.
    np.testing.assert_allclose(books.friction, k * speed**2, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(books.motor, 9.81 * 0.03, rtol=1e-15)
    assert not books.effects.any()


@pytest.mark.parametrize(
    "effects",
    [(), (udd.effects.relaxation(b=6.0),), (udd.effects.quadratic_drag(c=1e-3), udd.effects.tilt(a=0.02))],
)
def test_the_books_balance(effects: tuple[udd.effects.Effect, ...]) -> None:
    run = udd.simulate(udd.Disk(0.03, effects=effects), np.arange(0, 10, 1e-3), [2.0, 0.02, -0.02, 0])
    books = udd.energy_balance(run)
    balance = books.work("motor") - books.work("friction") + books.work("effects")
    # The trapezoidal rule at 1 ms errs by dT^2/12 T max|P''|, about 1e-6 of g L = 0.4 m^2/s^2.
    np.testing.assert_allclose(balance, books.stored - books.stored[0], atol=1e-5)


def test_a_periodic_orbit_of_the_dle_spends_what_it_gets() -> None:
    # w = 10: period 3.35832224912 (reference), so that the average over it is w exactly.
    settled = udd.simulate(udd.DLE(10.0), [0.0, 500.0], [1, 1, 0.01]).state[-1]
    late = udd.simulate(udd.DLE(10.0), np.linspace(0, 3.35832224912, 4001), settled)
    books = udd.energy_balance(late)
    assert books.work("friction")[-1] / 3.35832224912 == pytest.approx(10.0, rel=1e-6)


def test_damping_counts_as_an_effect() -> None:
    model = udd.DLE(3.0, B=0.2)
    run = udd.simulate(model, np.arange(0, 5, 0.01), [1, 1, 0.5])
    np.testing.assert_allclose(
        udd.energy_balance(run).effects, -0.2 * 3.0 * run.z, rtol=0, atol=1e-13
    )  # rounding


def test_a_model_of_ones_own_has_no_books() -> None:
    own = udd.Model(["x"], {"x": "-x"})
    with pytest.raises(udd.errors.ModelError, match="no energy is known"):
        udd.energy_balance(udd.simulate(own, 1.0, [1.0]))


def test_the_name_of_before_works_with_a_warning():
    with pytest.warns(DeprecationWarning, match="energy_balance"):
        assert udd.energy_books is udd.energy_balance
