"""All connections of an interval, against published values and another integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

import udd
from udd.bifurcations.boundary_value import ConnectingCurve
from udd.bifurcations.connecting_orbits import found_by
from udd.bifurcations.flow_map import flow_of
from udd.errors import ModelError


def test_lorenz_has_his_homoclinic_orbit() -> None:
    lorenz = udd.Model(["x", "y", "z"], ["10*(y-x)", "r*x-y-x*z", "x*y-8/3*z"], {"r": 28.0})
    connections = udd.connections(lorenz, "r", (10.0, 16.0), n=10)
    (one,) = connections
    # Published with fewer digits: 13.926 (C. Sparrow, The Lorenz equations, 1982).
    assert one.kind == "homoclinic" and one.value == pytest.approx(13.926557407520, abs=1e-9)
    assert one.error < 1e-11
    np.testing.assert_allclose(one.equilibrium.state, 0.0, atol=1e-12)
    assert connections.search.startswith("1 manifolds compared at 10 values of r from 10 to 16")


def test_the_dle_has_those_that_another_integrator_has() -> None:
    # About one with a saddle-focus there are others, of more rounds, which take longer.
    connections = udd.connections(udd.DLE(3.4), "w", (3.36, 3.4), n=10, t_max=11.0)
    assert all(one.wild and one.error < 1e-11 for one in connections)
    (one,) = (one for one in connections if one.kind == "homoclinic")
    assert one.value == pytest.approx(3.3768624337325, abs=1e-9)

    def nearest(w: float) -> tuple[float, int]:
        """How near the stable manifold comes to the rotating state, backward in time, and its side."""
        size = np.sqrt(w)
        at = np.array([size, size, 0.0])
        matrix = np.array([[-1.0, 1.0, 0.0], [0.0, 0.0, size], [-size, -size, 0.0]])
        numbers, vectors = np.linalg.eig(matrix)
        left = np.linalg.inv(vectors)[np.argmin(numbers.real)].real
        slow = vectors[:, np.argmin(numbers.real)].real
        closest = []
        for sign in (1.0, -1.0):
            run = integrate.solve_ivp(
                lambda t, s: [s[0] - s[1], -s[0] * s[2], s[0] * s[1] - w],
                [0.0, 40.0],
                at + 1e-5 * sign * slow,
                "DOP853",
                rtol=1e-11,
                atol=1e-12,
                events=_far,
                max_step=0.05,
            )
            gone = run.t > 8.0
            away = np.linalg.norm(run.y.T - at, axis=1)[gone]
            k = int(np.argmin(away))
            # A little later the side is the one on which it leaves.
            later = min(k + 20, len(away) - 1)
            closest.append((float(away[k]), int(np.sign(left @ (run.y.T[gone][later] - at)))))
        return min(closest)

    (near, before), (_, after) = (nearest(one.value + d) for d in (-1e-7, 1e-7))
    assert near < 1.2  # from 1e-3 away it is 1.8
    assert before == -after


# The coarse grid asks for the same pair as the fine one.
@pytest.mark.parametrize("n", [4, pytest.param(12, marks=pytest.mark.nightly)])
def test_what_is_found_does_not_hang_on_the_grid(n: int) -> None:
    # Pairs so near to each other that coarse grids stepped over both, and fine ones saw no change.
    known = [6.46524562656, 6.465246585675]
    connections = udd.connections(udd.DLE(6.0), "w", (6.3, 6.6), n=n, t_max=12.0)
    np.testing.assert_allclose([one.value for one in connections], known, atol=1e-11)
    assert connections.search.endswith("longer ones may exist")


def test_a_model_that_blows_up_on_one_side_of_its_connection() -> None:
    model = udd.Model(["x", "v"], ["v", "x^2 - 1 + v*(b + x)"], {"b": 0.85})
    (one,) = udd.connections(model, "b", (0.6, 0.9), n=4, t_max=8.0)
    assert one.kind == "homoclinic"

    def end(b: float) -> float:
        """Where the saddle's unstable manifold is when it has gone round: inside, or past the saddle."""
        growing = (b + 1 + np.sqrt((b + 1) ** 2 + 8)) / 2
        start = np.array([1.0, 0.0]) - 1e-6 * np.array([1.0, growing])
        run = integrate.solve_ivp(
            lambda t, s: [s[1], s[0] ** 2 - 1 + s[1] * (b + s[0])],
            [0.0, 60.0],
            start,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=_far,
        )
        return float(run.y[0, -1])

    # Past the saddle it goes away without end.
    assert {end(one.value + d) > 5.0 for d in (-1e-7, 1e-7)} == {False, True}


def _far(t: float, s: np.ndarray) -> float:
    return float(40.0 - np.abs(s).max())


_far.terminal = True  # type: ignore[attr-defined]


def test_where_there_can_be_none() -> None:
    with pytest.raises(ModelError, match="one eigenvalue alone"):
        udd.connections(udd.Model(["x", "v"], ["v", "m*(1-x^2)*v-x"], {"m": 1.0}), "m", (0.5, 1.0), n=5)
    with pytest.raises(ModelError, match="must be finite"):
        udd.connections(udd.DLE(3.4), "w", (1.0, np.inf))
    orbit = udd.periodic_orbit(udd.Model(["x", "v"], ["v", "-sin(x)"]), [1.0, 0.0])
    with pytest.raises(ModelError, match="over a parameter of the model, not over period"):
        udd.connection(udd.continuation(orbit, "period", (6.6, 7.0)))


@pytest.mark.nightly  # test_lorenz_has_his_homoclinic_orbit asks the same of another model
def test_a_jerk_equation_has_its_homoclinic_orbit_by_default() -> None:
    model = udd.Model(["x", "v", "a"], ["v", "a", "-a - 0.4*v + mu*x*(1 - x)"], {"mu": 0.7})
    (one,) = udd.connections(model, "mu", (0.73985982, 0.73985983), n=2)
    # To 36 digits by a Taylor method.
    assert one.kind == "homoclinic" and abs(one.value - 0.7398598229327773) <= one.error < 1e-11


@pytest.mark.parametrize(("c", "k"), [(0.3, -1.0), (0.7, -0.5)])
def test_the_bounds_of_connections_hold_against_closed_forms(c: float, k: float) -> None:
    # The rate of the energy H less that of the saddles is y^2 (b - c + k H): an orbit of saddles at b = c.
    for kind, pull, energy, start in (
        ("homoclinic", "x - x^2", "y^2/2 - x^2/2 + x^3/3", 1.3),
        ("heteroclinic", "x^3 - x", "y^2/2 + x^2/2 - x^4/4 - 1/4", 0.6),
    ):
        model = udd.Model(["x", "y"], ["y", f"{pull} + y*(b - {c} + {k}*({energy}))"], {"b": c + 0.1 * k})
        orbit = udd.periodic_orbit(model, [start, 0.0], settle=100.0)
        one = udd.connection(udd.continuation(orbit, "b", (0.0, 1.0), direction="up", max_period=30.0))
        assert one.kind == kind and abs(one.value - c) <= one.error < 1e-12


def test_a_front_connects_two_equilibria_that_are_no_mirror_images() -> None:
    # Nagumo's equation: u = 1/(1 + exp(t/sqrt(2))) at the speed (1 - 2 a)/sqrt(2).
    model = udd.Model(["u", "v"], ["v", "-c*v - u*(1 - u)*(u - 0.3)"], {"c": 0.3})
    flow, t = flow_of(model, np.array([[1.0, 0.5]])), np.linspace(-20.0, 20.0, 81)
    u = 1.0 / (1.0 + np.exp(t / np.sqrt(2.0)))
    nodes, rests = np.column_stack([u, -u * (1.0 - u) / np.sqrt(2.0)]), np.array([[1.0, 0.0], [0.0, 0.0]])
    guess = ConnectingCurve.through(flow, flow.values, 0, rests, np.ones(2), nodes, 40.0)
    one = found_by(*guess, "c")
    assert one.kind == "heteroclinic" and abs(one.value - 0.4 / np.sqrt(2.0)) <= one.error < 1e-12


def test_what_collapses_to_its_equilibrium_is_no_connection() -> None:
    model = udd.Model(["x", "v"], ["v", "x - x^3 + v*(b - x^2)"], {"b": 0.5})
    flow = flow_of(model, np.array([[1.0, 0.5]]))
    nodes = 1e-3 * np.column_stack([np.linspace(1.0, 0.5, 9), np.linspace(1.0, -0.5, 9)])
    guess = ConnectingCurve.through(flow, flow.values, 0, np.zeros(2), np.ones(2), nodes, 2.0)
    with pytest.raises(ModelError, match="no connection is found"):
        found_by(*guess, "b")
