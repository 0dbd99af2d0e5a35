"""Sliding modes of formula models: set-valued dry friction that sticks."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import udd
from udd import _core

Array = NDArray[np.float64]
METHODS = ["dopri5", "dop853", "taylor", "rodas"]


def coulomb_pendulum(c: float) -> udd.Model:
    """The built-in pendulum with dry friction, as text."""
    text = "(-g*length*sin(theta) - k0*Omega - c*sign(Omega))/length^2"
    values = {"g": 9.81, "length": 0.5, "k0": 1e-3, "c": c}
    return udd.Model(["Omega", "theta"], [text, "Omega"], values, angles=["theta"])


@pytest.mark.parametrize("method", METHODS)
def test_as_the_built_in_pendulum(method: str) -> None:
    dry = udd.effects.coulomb(c=0.4, treatment="set-valued")
    t = np.linspace(0, 10, 101)
    built_in = udd.simulate(udd.Pendulum(0.5, k0=1e-3, effects=dry), t, [0.0, 1.2], rtol=1e-11, atol=1e-13)
    run = udd.simulate(coulomb_pendulum(0.4), t, [0.0, 1.2], method=method, rtol=1e-11, atol=1e-13)
    # Two codes to 1e-11 a step, over a few swings.
    np.testing.assert_allclose(run.state, built_in.state, atol=1e-8)
    assert run.events.kind[-1] == "stick"
    assert run.state[-1, 0] == 0.0
    np.testing.assert_allclose(run.events.t, built_in.events.t, atol=1e-8)


def test_a_block_on_a_belt() -> None:
    """Stick-slip: the block rides along until the spring exceeds the friction at rest."""
    belt = udd.Model(["x", "v"], ["v", "-x - where(v < vb, -F, F)"], {"vb": 0.2, "F": 1.5})
    assert belt.rates(0.0, [0.0, 0.1])[1] == 1.5
    text = "-x - F*sign(v - vb)/(1 + abs(v - vb))"
    run = udd.simulate(belt.replace(F=1.5), 20.0, [0.0, 0.2], rtol=1e-11, atol=1e-12)
    assert run.events.kind[0] == "slip"
    # v = vb from the start on, and x = F where it is let go.
    assert run.events.t[0] == pytest.approx(1.5 / 0.2, abs=1e-9)
    weak = udd.Model(["x", "v"], ["v", text], {"vb": 0.2, "F": 1.5})
    again = udd.simulate(weak, 60.0, [0.0, 0.2], rtol=1e-11, atol=1e-12)
    slips = again.events.t[np.array(again.events.kind) == "slip"]
    sticks = again.events.t[np.array(again.events.kind) == "stick"]
    assert len(slips) > 3
    # Periodic: it sticks for the same time in each period, from -x to x.
    np.testing.assert_allclose(np.diff(slips), slips[1] - slips[0], atol=1e-7)
    np.testing.assert_allclose(slips[1:] - sticks[: len(slips) - 1], slips[1] - sticks[0], atol=1e-7)


def test_a_relay_that_does_not_hold_is_passed() -> None:
    """`-sign(x)` in the rate of x's rate pulls from both sides, but x' does not jump."""
    relay = udd.Model(["x", "v"], ["v", "-sign(x)"])
    run = udd.simulate(relay, 12.0, [0.5, 0.0], rtol=1e-11, atol=1e-12)
    # Parabolas: a quarter of the period takes sqrt(2 x0).
    np.testing.assert_allclose(run.events.t[:3], np.array([1.0, 3.0, 5.0]), atol=1e-9)
    assert set(run.events.kind) == {"jump"}


def test_a_sliding_mode_that_is_not_at_rest() -> None:
    """A first-order sliding mode on x + 2 y = 0, on which the motion is x' = -x/2."""
    law = udd.Model(["x", "y"], ["y", "-3*sign(x + 2*y)"])
    run = udd.simulate(law, np.linspace(0, 4, 41), [0.4, -0.2], rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(run.state[:, 0], 0.4 * np.exp(-run.t / 2), atol=1e-9)
    np.testing.assert_allclose(run.state @ [1.0, 2.0], 0.0, atol=1e-12)


def test_derivatives_pass_through_sticking_and_slipping() -> None:
    text = ["v", "-x - 0.3*v - (1 + 0.3*cos(1.1*t))*c*sign(v) + f*cos(0.7*t)"]
    model = udd.Model(["x", "v"], text, {"c": 0.5, "f": 0.7})
    run = udd.simulate(model, 12.0, [1.0, -0.1])
    kinds = list(run.events.kind)
    assert kinds.count("stick") == kinds.count("slip") == 3
    by, start = 1e-6, np.array([1.0, -0.1])
    pieces = _core.shoot(
        model, np.array([[0.5, 0.7]]), start[None], np.zeros(1), np.full(1, 12.0), [0, 1], 1e-12, 1e-14
    )

    def end(c: float, f: float) -> Array:
        run = udd.simulate(model.replace(c=c, f=f), [0, 12], start, method="dop853", rtol=1e-13, atol=1e-15)
        state: Array = run.state[-1]
        return state

    apart = [(end(0.5 + by, 0.7) - end(0.5 - by, 0.7)), (end(0.5, 0.7 + by) - end(0.5, 0.7 - by))]
    # Central differences of runs to 1e-13 over 2e-6.
    np.testing.assert_allclose(pieces["by_parameter"][0], np.transpose(apart) / (2 * by), atol=3e-6)


def test_friction_that_another_jump_changes() -> None:
    """Half the friction on the side x < 1, where it does not hold what the other side's would."""
    law = udd.Model(["x", "v"], ["v", "u0 - where(x > 1, 1, 0.5)*sign(v)"], {"u0": -0.7})
    np.testing.assert_allclose(law.rates(0.0, [0.0, 0.0]), [0.0, -0.2])
    run = udd.simulate(law, 2.0, [0.0, 0.0], rtol=1e-10, atol=1e-12)
    assert run.state[-1, 0] == pytest.approx(-0.2 * 2.0**2 / 2, abs=1e-9)
    held = law.replace(u0=0.7)
    np.testing.assert_array_equal(held.rates(0.0, [1.5, 0.0]), [0.0, 0.0])
    np.testing.assert_allclose(held.rates(0.0, [0.5, 0.0]), [0.0, 0.2])


@pytest.mark.parametrize("text", ["where(x > 0, 1, 2)", "1 - where(x > 0, x, 0)"])
def test_a_start_on_a_surface_that_is_left_at_second_order(text: str) -> None:
    run = udd.simulate(udd.Model(["x", "v"], ["v", text]), 1.0, [0.0, 0.0], rtol=1e-10, atol=1e-12)
    assert run.outcome == "finished"
    # v' = 1 for x > 0, or 1 - x.
    assert run.state[-1, 0] == pytest.approx(0.5 if "2" in text else 1 - np.cos(1.0), abs=1e-8)


def test_friction_beside_a_spring_that_acts_on_one_side() -> None:
    """At (0, 0) on two surfaces, of which only one holds."""
    law = udd.Model(["x", "v"], ["v", "u - F*sign(v) - where(x > 0, k*x, 0)"], {"F": 1.0, "k": 5.0, "u": 0.5})
    np.testing.assert_array_equal(law.rates(0.0, [0.0, 0.0]), [0.0, 0.0])
    np.testing.assert_allclose(law.replace(u=1.5).rates(0.0, [0.0, 0.0]), [0.0, 0.5])
    frictionless = law.replace(F=0.0)
    np.testing.assert_allclose(frictionless.rates(0.0, [0.0, 0.0]), [0.0, 0.5])


def test_room_is_for_surfaces_that_can_hold() -> None:
    """Three walls of the coordinate before the friction in the text."""
    text = "-k*x - where(x > 2, 1, 0) - where(x > 3, 1, 0) + where(x < -2, 1, 0) - F*sign(v)"
    run = udd.simulate(udd.Model(["x", "v"], ["v", text], {"k": 1.0, "F": 0.3}), 20.0, [1.4, 0.0])
    assert run.outcome == "finished"
    assert run.events.kind[-1] == "stick"


class Chain:
    """A double pendulum with dry joints, event by event: modes by trying all, forces by linear equations."""

    m, lengths, centres, inertia, g = (0.5, 0.4), 0.3, (0.2, 0.18), (0.03, 0.02), 9.81
    dry = np.array([0.12, 0.05])
    viscous = np.array([0.002, 0.003])
    joints = np.array([[1.0, 0.0], [-1.0, 1.0]])

    def model(self) -> udd.Model:
        return udd.pendulum_chain(
            self.m, [self.lengths] * 2, self.centres, self.inertia, friction=self.viscous, dry=self.dry
        )

    def accelerations(self, x: Array, mode: Sequence[int]) -> tuple[Array, Array]:
        """Those, and the torques of the joints' dry friction; 0 is a joint that sticks."""
        (a1, a2, w1, w2), coupling = x, self.lengths * self.m[1] * self.centres[1]
        mixed = coupling * np.cos(a1 - a2)
        mass = np.array([[self.inertia[0] + self.lengths**2 * self.m[1], mixed], [mixed, self.inertia[1]]])
        inverse, bend = np.linalg.inv(mass), coupling * np.sin(a1 - a2)
        upper = self.m[0] * self.centres[0] + self.lengths * self.m[1]
        force = np.array(
            [
                -bend * w2**2 - self.g * upper * np.sin(a1),
                bend * w1**2 - self.g * self.m[1] * self.centres[1] * np.sin(a2),
            ]
        )
        force = force - self.joints.T @ (self.viscous * (self.joints @ [w1, w2]))
        torque = -self.dry * np.array(mode)
        stuck = [i for i in range(2) if mode[i] == 0]
        free = inverse @ (force + self.joints.T @ torque)
        if stuck:
            inner = (self.joints @ inverse @ self.joints.T)[np.ix_(stuck, stuck)]
            torque[stuck] = np.linalg.solve(inner, -(self.joints @ free)[stuck])
        return inverse @ (force + self.joints.T @ torque), torque

    def mode(self, x: Array, moving: Sequence[int]) -> list[int]:
        """The only consistent one, where the joints whose sign is 0 are at rest."""
        rest = [i for i in range(2) if moving[i] == 0]
        for tried in itertools.product(*[(0, 1, -1)] * len(rest)):
            mode = list(moving)
            for i, value in zip(rest, tried, strict=True):
                mode[i] = value
            rates, torque = self.accelerations(x, mode)
            away = np.array(mode) * (self.joints @ rates)
            if all(abs(torque[i]) <= self.dry[i] + 1e-12 if mode[i] == 0 else away[i] >= 0 for i in rest):
                return mode
        raise AssertionError("no mode is consistent")

    def run(self, start: Sequence[float], times: Array) -> tuple[Array, list[float]]:
        """States at these times, and the times of the events."""
        t, x = 0.0, np.array(start, dtype=float)
        mode = self.mode(x, [int(s) for s in np.sign(self.joints @ x[2:])])
        states: list[Array] = []
        events: list[float] = []
        while len(states) < len(times):

            def rates(_t: float, x: Array, mode: tuple[int, ...] = tuple(mode)) -> Array:
                return np.concatenate([x[2:], self.accelerations(x, mode)[0]])

            def watch(i: int, mode: tuple[int, ...] = tuple(mode)) -> object:
                def reversal(_t: float, at: Array) -> float:
                    return float(mode[i] * (self.joints @ at[2:])[i])

                def limit(_t: float, at: Array) -> float:
                    return float(self.dry[i] - abs(self.accelerations(at, mode)[1][i]))

                event = reversal if mode[i] else limit
                event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
                return event

            sol = solve_ivp(
                rates,
                (t, times[-1]),
                x,
                method="DOP853",
                rtol=1e-12,
                atol=1e-13,
                events=[watch(0), watch(1)],
                dense_output=True,
                max_step=0.02,
            )
            inside = times[len(states) :]
            states += [sol.sol(time) for time in inside[inside <= sol.t[-1]]]
            t, x = sol.t[-1], sol.y[:, -1].copy()
            if sol.status != 1:
                break
            k = int(np.argmax([len(own) for own in sol.t_events]))
            speeds = self.joints @ x[2:]
            moving = list(mode)
            if mode[k] == 0:
                moving[k] = -int(np.sign(self.accelerations(x, mode)[1][k]))
            else:
                moving[k] = 0
            speeds[k] = 0.0
            speeds[[i for i in range(2) if mode[i] == 0]] = 0.0
            x[2:] = np.linalg.solve(self.joints, speeds)
            mode = self.mode(x, moving)
            events.append(float(t))
        return np.array(states), events


@pytest.mark.parametrize(
    "start", [[0.6, -0.8, 0.0, 0.0], [0.05, 0.03, 0.0, 0.0], [0.6, -0.8, 0.5, 0.1], [0.02, 0.3, 0.0, 0.0]]
)
def test_two_joints_that_stick(start: list[float]) -> None:
    chain, times = Chain(), np.linspace(0, 4, 81)
    expected, events = chain.run(start, times)
    run = udd.simulate(chain.model(), times, start, method="dop853", rtol=1e-11, atol=1e-12)
    # Both to some 1e-12 a step, over ten events.
    np.testing.assert_allclose(run.state, expected, atol=1e-9)
    np.testing.assert_allclose(run.events.t, events, atol=1e-9)


def test_motors_that_let_joints_go() -> None:
    """Two joints that stick and the clock of two inputs: more surfaces than any other law has."""
    made = Chain()
    chain = udd.pendulum_chain(
        made.m, [made.lengths] * 2, made.centres, made.inertia, dry=made.dry, motors=True
    )
    t = np.linspace(0, 6, 301)
    torques = {"tau1": 0.3 * np.sin(1.7 * t) ** 3, "tau2": 0.1 * np.sin(2.3 * t)}
    run = udd.simulate(chain, t, [0.0, 0.0, 0.0, 0.0], inputs=torques, rtol=1e-10, atol=1e-12)
    kinds = list(run.events.kind)
    assert run.outcome == "finished"
    assert kinds.count("stick") > 2
    assert kinds.count("slip") > 2
    # The limit of narrow widths, with an error of the size of a creep through the width.
    close = udd.Model(
        ["a1", "a2", "w1", "w2"],
        {
            k: v.replace("sign(w1)", "tanh(w1/e)").replace("sign(w2 - w1)", "tanh((w2 - w1)/e)")
            for k, v in chain.equations.items()
        },
        dict(chain.parameters) | {"e": 1e-4},
        angles=["a1", "a2"],
        inputs=["tau1", "tau2"],
    )
    smooth = udd.simulate(
        close, t, [0.0, 0.0, 0.0, 0.0], inputs=torques, method="rodas", rtol=1e-8, atol=1e-10
    )
    np.testing.assert_allclose(run.state[:, :2], smooth.state[:, :2], atol=1e-3)


def test_a_surface_that_an_input_moves_is_not_slid_on() -> None:
    """A driven belt has no rate here; the run reports that it switches without end."""
    belt = udd.Model(["x", "v"], ["v", "-x - 3*sign(v - u)"], inputs=["u"])
    t = np.linspace(0, 1, 11)
    run = udd.simulate(belt, t, [0.0, 0.5], inputs={"u": 0.1 * np.sin(t)})
    assert run.outcome == "chattering"
