"""Models that are undefined at negative states, and how completely equilibria are found."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import ModelError


def two_tanks(**more: str) -> udd.Model:
    inflow = more.get("inflow", "q")
    return udd.Model(
        ["h1", "h2"],
        [f"{inflow} - a*sqrt(h1)", "a*sqrt(h1) - b*sqrt(h2)"],
        {"q": 1.0, "a": 0.5, "b": 0.4},
    )


def toggle_switch() -> udd.Model:
    return udd.Model(["x", "y"], ["a/(1+y^n) - x", "a/(1+x^n) - y"], {"a": 5.0, "n": 2.0})


def herd_predation() -> udd.Model:
    return udd.Model(["N", "P"], ["N*(1-N) - sqrt(N)*P", "P*(-s + c*sqrt(N))"], {"s": 0.5, "c": 1.0})


@pytest.mark.parametrize("near", [None, [4.0, 6.0]])
def test_tanks_have_their_levels(near: list[float] | None) -> None:
    result = udd.equilibria(two_tanks(), near=near)
    # (q/a)^2 and (q/b)^2.
    assert [rest.state.tolist() for rest in result] == [pytest.approx([4.0, 6.25], abs=1e-12)]


def test_tanks_are_followed_over_their_inflow() -> None:
    (rest,) = udd.equilibria(two_tanks(), near=[4.0, 6.0])
    branch = udd.continuation(rest, "q", (0.5, 2.0))
    levels = branch.values[:, None] ** 2 / np.array([0.25, 0.16])
    np.testing.assert_allclose(branch.states, levels, rtol=1e-9)


def test_a_switch_has_three_states_with_an_exponent_that_is_a_parameter() -> None:
    equilibria = udd.equilibria(toggle_switch())
    # x^3 + x = 5, and (5 +- sqrt 21)/2.
    low, high = (5 - np.sqrt(21)) / 2, (5 + np.sqrt(21)) / 2
    same = np.roots([1, 0, 1, -5])
    middle = float(same[np.isreal(same)].real[0])
    states = np.array(sorted(rest.state.tolist() for rest in equilibria))
    np.testing.assert_allclose(states, [[low, high], [middle, middle], [high, low]], rtol=1e-10)


def test_a_herd_has_its_coexistence_and_its_cycle_is_not_refused() -> None:
    result = udd.equilibria(herd_predation(), near=[0.25, 0.375])
    # (s/c)^2 and sqrt(N) (1 - N).
    assert any(np.allclose(rest.state, [0.25, 0.375], atol=1e-10) for rest in result)
    # Trace sqrt(N)(1 - 3N)/(2 sqrt(N)) > 0 below N = 1/3: unstable. There is no refusal as "depends on time".
    model = udd.Model(["x", "v"], ["v", "-x^1.5 + 1 - 0.0*v"])
    assert udd.periodic_orbit(model, [1.2, 0.0], period=5.1).period == pytest.approx(5.13, abs=0.05)


@pytest.mark.parametrize("equation", ["sqrt(x) - 2 + 0.1*cos(t)", "ln(x - 2) + cos(t)"])
def test_what_depends_on_time_is_still_refused(equation: str) -> None:
    with pytest.raises(ModelError, match="the rates depend on time"):
        udd.equilibria(udd.Model(["x"], [equation]), near=[4.0])


def test_a_forcing_without_amplitude_is_no_dependence_on_time() -> None:
    model = udd.Model(["x"], ["sqrt(x) - 2 + a*cos(t)"], {"a": 0.0})
    assert [rest.state.tolist() for rest in udd.equilibria(model)] == [[pytest.approx(4.0)]]


def test_a_forced_model_with_a_root_has_its_period() -> None:
    model = udd.Model(["h"], ["1 + 0.5*cos(w*t) - sqrt(h)"], {"w": 2.0})
    orbit = udd.periodic_orbit(model, [1.0], period="2*pi/w")
    assert orbit.period == pytest.approx(np.pi) and abs(orbit.multipliers[0]) < 1.0


@pytest.mark.parametrize(
    ("exponent", "x", "value"), [(2.0, -1.0, 1.0), (3.0, -2.0, -8.0), (-1.0, -4.0, -0.25), (0.0, 0.0, 1.0)]
)
def test_whole_powers_of_negative_numbers(exponent: float, x: float, value: float) -> None:
    model = udd.Model(["x"], ["x^n"], {"n": exponent})
    assert model.rates(0.0, [x]).tolist() == [value]


def test_other_powers_of_negative_numbers_are_undefined() -> None:
    assert np.isnan(udd.Model(["x"], ["x^n"], {"n": 1.5}).rates(0.0, [-1.0])).all()


def test_whole_powers_have_their_derivatives_at_zero() -> None:
    model = udd.Model(["x"], ["a*x^n/(1 + x^n) - x"], {"a": 3.0, "n": 2.0})
    # At 0, and where x^2 - 3x + 1 = 0.
    states = sorted(float(rest.state[0]) for rest in udd.equilibria(model))
    np.testing.assert_allclose(states, [0.0, *(3 + np.sqrt(5) * np.array([-1, 1])) / 2], atol=1e-12)


@pytest.mark.parametrize(
    ("equations", "count"),
    [
        (["x - x^3", "y - y^3", "z - z^3"], 27),
        (["4*x - x^3", "y + 2 - (y + 2)^3", "z - 1 - (z - 1)^3"], 27),
        (["x - x^3 + 0.05*y", "y - y^3 + 0.05*x", "z - z^3"], 27),
        (["x - x^3", "y - y^3", "z*(1 - z^2)*(4 - z^2)"], 45),
    ],
)
def test_all_equilibria_of_several_wells(equations: list[str], count: int) -> None:
    assert len(udd.equilibria(udd.Model(["x", "y", "z"], equations))) == count
