"""Mechanisms: the double pendulum as textbooks have it, energy, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import udd
from udd.errors import ModelError
from udd.models.mechanisms import check_accelerations
from udd.models.serialization import model_from_dict, model_to_dict

G = 9.81


def point_masses(n: int, **more: Any) -> Any:
    ones = [1.0] * n
    return udd.pendulum_chain(ones, ones, ones, ones, **more)


def test_the_double_pendulum_of_the_textbooks() -> None:
    # Two unit point masses on unit rods, solved for the accelerations by hand.
    rng = np.random.default_rng(1)
    for a1, a2, w1, w2 in rng.normal(size=(20, 4)) * 2:
        d = a1 - a2
        low = 3 - np.cos(2 * d)
        first = (
            -3 * G * np.sin(a1) - G * np.sin(a1 - 2 * a2) - 2 * np.sin(d) * (w2**2 + w1**2 * np.cos(d))
        ) / low
        second = 2 * np.sin(d) * (2 * w1**2 + 2 * G * np.cos(a1) + w2**2 * np.cos(d)) / low
        rates = point_masses(2).rates(0.0, [a1, a2, w1, w2])
        np.testing.assert_allclose(rates, [w1, w2, first, second], rtol=1e-12, atol=1e-12)


def test_three_links_keep_their_energy() -> None:
    chain = point_masses(3)
    run = udd.simulate(chain, np.linspace(0, 5, 50), [1.0, 2.0, 2.5, 0, 0, 0], method="auto", rtol=1e-11)
    a, w = run.state[:, :3], run.state[:, 3:]
    kinetic = 0.5 * np.einsum("ni,nij,nj->n", w, chain.mass_matrix(run.state), w)
    energy = kinetic - G * (3 * np.cos(a[:, 0]) + 2 * np.cos(a[:, 1]) + np.cos(a[:, 2]))
    # Some thousand steps of 1e-11 of energies of some tens.
    np.testing.assert_allclose(energy, energy[0], atol=1e-7)


def test_friction_and_motors_act_in_the_joints() -> None:
    chain = point_masses(2, friction=[0.3, 0.2], motors=True)
    signals = {
        name: udd.InputSignal([0.0, 1.0], [value] * 2) for name, value in (("tau1", 0.7), ("tau2", -0.4))
    }
    state = np.array([0.0, 0.0, 1.5, -0.5])
    rates = chain.with_inputs(signals).rates(0.5, state)[2:]
    # Hanging, M = [[2, 1], [1, 1]]; joint 2 turns link 2 by its torque and link 1 back.
    second = -0.4 - 0.2 * (-0.5 - 1.5)
    force = [0.7 - 0.3 * 1.5 - second, second]
    np.testing.assert_allclose(rates, np.linalg.solve([[2.0, 1.0], [1.0, 1.0]], force), rtol=1e-12)


def test_rotors_turn_with_their_joints() -> None:
    chain = point_masses(3, rotors=[0.1, 0.2, 0.3])
    state = np.array([0.3, -1.0, 2.0, 1.5, -0.5, 0.7])
    more = chain.mass_matrix(state) - point_masses(3).mass_matrix(state)
    joints = np.array([1.5, -0.5 - 1.5, 0.7 + 0.5])
    energy = 0.5 * np.sum([0.1, 0.2, 0.3] * joints**2)
    # Adding to elements of order one and taking them away again leaves rounding.
    np.testing.assert_allclose(0.5 * state[3:] @ more @ state[3:], energy, rtol=1e-13)


def test_a_missing_force_enters_every_acceleration() -> None:
    chain = point_masses(2)
    pushed = chain.with_effects([udd.effects.formula("force(a2)", "c", c=0.5)])
    state = [0.3, -0.4, 0.0, 0.0]
    more = pushed.rates(0.0, state) - chain.rates(0.0, state)
    np.testing.assert_allclose(more[2:], np.linalg.solve(chain.mass_matrix(state), [0.0, 0.5]), rtol=1e-10)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (({"q": "v"}, [["1", "0"]], ["0"]), "1 coordinates need 1 forces and a mass matrix of 1 x 1"),
        (({"q": "v"}, [["1"]], []), "not 0 forces and rows of 1"),
        (({"q": "v"}, 3, ["0"]), "mass must be a table of formulas"),
        ((["q"], [["1"]], ["0"]), "coordinates must be a table"),
        (({"q": "v"}, [["-1"]], ["0"]), "must be positive definite"),
        (({"q": "v"}, [["m"]], ["0"]), "unknown name m"),
    ],
)
def test_bad_mechanisms_are_named(arguments: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        udd.mechanism(*arguments)


def test_chains_have_one_to_three_links() -> None:
    with pytest.raises(ModelError, match="1 to 3 links"):
        udd.pendulum_chain([1.0] * 4, [1.0] * 4, [1.0] * 4, [1.0] * 4)
    with pytest.raises(ModelError, match="not 2, 2, 1, 2 of them"):
        udd.pendulum_chain([1.0] * 2, [1.0] * 2, [1.0], [1.0] * 2)


CART = {
    "mechanism": {
        "coordinates": {"x": "u", "a": "w"},
        "mass": [["M + m", "m*l*cos(a)"], ["m*l*cos(a)", "m*l^2"]],
        "forces": ["-c*u + m*l*sin(a)*w^2 + push", "-m*9.81*l*sin(a)"],
    },
    "parameters": {"M": 1.0, "m": 0.2, "l": 0.5, "c": 0.1},
    "angles": ["a"],
    "inputs": ["push"],
}


def test_a_mechanism_can_be_written_down() -> None:
    made = udd.mechanism(
        **CART["mechanism"], parameters=CART["parameters"], angles=CART["angles"], inputs=CART["inputs"]
    )
    read = model_from_dict({"kind": "formula", **CART})
    assert read == made and read.mass
    assert model_from_dict(model_to_dict(read)) == made
    brake = {"formula": {"slot": "force(a)", "expression": "-b*w", "name": "brake", "parameters": {"b": 0.1}}}
    assert [e.name for e in model_from_dict({"kind": "formula", **CART, "effects": [brake]}).effects] == [
        "brake"
    ]


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"states": ["x", "u"]}, "not both: leave out mechanism, or states"),
        ({"mass": [["1"]]}, "not both: leave out mechanism, or mass"),
        ({"mechanism": {"coordinates": {"x": "u"}, "mass": [["1"]]}}, "does not say its forces"),
        ({"mechanism": {"coordinates": {"x": "u"}, "mass": [["1"]], "forces": []}}, "need 1 forces"),
        ({"mechanism": {**CART["mechanism"], "force": []}}, "the mechanism has no 'force'"),
        ({"mechanism": 3}, "the mechanism must be a table"),
        ({"state": 3}, "a model with a mechanism has no 'state'"),
        ({"parameters": 3}, "cannot be read"),
    ],
)
def test_a_mechanism_that_does_not_fit_is_refused(changed: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says) as caught:
        model_from_dict({"kind": "formula", **CART, **changed})
    assert len(str(caught.value)) < 300


def test_forces_as_accelerations_are_refused() -> None:
    chain = udd.pendulum_chain([0.5, 0.3], [0.4, 0.3], [0.2, 0.1], [0.03, 0.01], motors=True)
    check_accelerations(chain)
    right = udd.mechanism(
        {"x": "u", "y": "v"},
        [["m", "0"], ["0", "n"]],
        ["k*(y - x)", "k*(x - y)"],
        {"m": 1.0, "n": 3.0, "k": 2.0},
    )
    check_accelerations(right)
    # Oscillators without coupling, and a free particle, are as good as forces as they are as accelerations.
    mass = [["m", "0"], ["0", "n"]]
    for rates in (["u", "v", "-k*x", "-2*k*y"], ["u", "v", "-k*u", "0"]):
        check_accelerations(udd.Model(["x", "y", "u", "v"], rates, dict(right.values), mass=mass))
    wrong = udd.Model(
        ["x", "y", "u", "v"], ["u", "v", "k*(y - x)", "k*(x - y)"], dict(right.values), mass=mass
    )
    with pytest.raises(ModelError, match="the equations look like forces") as caught:
        check_accelerations(wrong)
    assert len(str(caught.value)) < 300
