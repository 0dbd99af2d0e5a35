"""Curves of bifurcations over two parameters, and the points at which they change."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

import udd
from tutorial_models import BAZYKIN, CO, REACTION
from tutorial_models import LORENZ84 as STRONGER
from udd.bifurcations.boundary_value import ConnectingCurve
from udd.bifurcations.connecting_orbits import found_by
from udd.bifurcations.flow_map import flow_of
from udd.bifurcations.invariant_manifolds import direction_alone

LORENZ84 = STRONGER.with_parameters({"G": 1.6, "F": 2.0})


def _positive(model: udd.Model) -> udd.Equilibrium:
    return next(rest for rest in udd.equilibria(model) if (rest.state > 1e-6).all())


def _of(curve: udd.Locus, kind: str) -> list[udd.LocusPoint]:
    return sorted((point for point in curve.points if point.kind == kind), key=lambda point: point.values[1])


@pytest.fixture(scope="module")
def oxidation() -> udd.Branch:
    """The equilibria of the oxidation of CO on platinum."""
    return udd.continuation(_positive(CO), "q2", (0.5, 2.0))


def test_folds_go_on_through_their_cusp(oxidation: udd.Branch) -> None:
    assert sorted(p.value for p in oxidation.find("fold")) == pytest.approx([1.0420485, 1.0522003], abs=1e-7)
    first, last = (udd.locus(fold, "k", (0.01, 2.0), within=(0.3, 3.0)) for fold in oxidation.find("fold"))
    for curve in (first, last):
        (cusp,) = _of(curve, "cusp")
        assert cusp.values[1] == pytest.approx(0.35599, abs=5e-6)
        assert (cusp.errors < 1e-11).all() and cusp.coefficient_errors["c"] < 1e-6 * abs(
            cusp.coefficients["c"]
        )
        assert curve.ends == ("the bound 2", "the bound 2") and len(_of(curve, "Bogdanov-Takens")) == 2
    # Either fold leads to the same points.
    for a, b in zip(_of(first, "Bogdanov-Takens"), _of(last, "Bogdanov-Takens"), strict=True):
        assert (np.abs(a.values - b.values) <= a.errors + b.errors).all()
        assert a.coefficients == pytest.approx(b.coefficients, rel=1e-6)


def test_curves_of_hopf_points_end_at_bogdanov_takens_points(oxidation: udd.Branch) -> None:
    folds = udd.locus(oxidation.find("fold")[0], "k", (0.01, 2.0), within=(0.3, 3.0))
    curve = udd.locus(oxidation.find("Hopf")[0], "k", (0.01, 2.0), within=(0.3, 3.0))
    assert curve.ends == ("a Bogdanov-Takens point",) * 2
    ends = _of(curve, "Bogdanov-Takens")
    for own, other in zip(ends, _of(folds, "Bogdanov-Takens"), strict=True):
        assert (np.abs(own.values - other.values) <= own.errors + other.errors).all()
        assert isinstance(own.solution, udd.Equilibrium)
        assert np.sort(np.abs(own.solution.eigenvalues))[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
    # Between two zeros of the first Lyapunov coefficient cycles are born unstable.
    assert [np.sign(point.coefficients["l2"]) for point in _of(curve, "Bautin")] == [-1.0, -1.0]
    inside = (curve.values[:, 1] - ends[0].values[1]) * (curve.values[:, 1] - ends[1].values[1]) < 0.0
    assert len(curve) > 10 and not inside[0]


def test_bazykins_cusps_are_triple_roots() -> None:
    branch = udd.continuation(_positive(BAZYKIN), "al", (0.0, 2.0))
    curve = udd.locus(branch.find("fold")[0], "d", (0.0, 3.0), within=(0.0, 2.0))
    assert curve.ends == ("the branch is closed",) * 2
    cusps = _of(curve, "cusp")
    results = [tuple(point.values.round(5)) for point in cusps]
    assert results == [(0.90123, 0.00357), (0.08877, 2.80236)]
    for cusp in cusps:
        al, d = cusp.values
        # With y from the first equation the second one is a cubic of x.
        pole = np.polynomial.Polynomial([1.0, al])
        cubic = np.polynomial.Polynomial([0, 1]) - pole - d * np.polynomial.Polynomial([1, -0.01]) * pole**2
        (x,) = cubic.deriv(2).roots()
        size = np.abs(cubic.coef) @ x ** np.arange(4)
        assert abs(cubic(x)) < 1e-12 * size and abs(cubic.deriv()(x)) * x < 1e-12 * size
    hopf = udd.locus(branch.find("Hopf")[0], "d", (0.0, 3.0), within=(0.0, 2.0))
    everything = np.vstack([hopf.values, *(point.values for point in (*hopf.points, *curve.points))])
    assert (everything >= -1e-12).all() and hopf.ends[1] == "a Bogdanov-Takens point"


def test_the_cusp_of_an_exothermic_reaction() -> None:
    branch = udd.continuation(udd.equilibria(REACTION, near=[0.1, 0.3])[0], "p1", (0.0, 1.0))
    known = {"fold": [0.0889318, 0.105739], "Hopf": [0.1309]}
    for kind, values in known.items():
        assert sorted(point.value for point in branch.find(kind)) == pytest.approx(values, abs=1e-5)
    curve = udd.locus(branch.find("fold")[0], "p3", (1.0, 4.0), within=(0.0, 1.0))
    (cusp,) = _of(curve, "cusp")
    # p2 = 4 (1 + p3) there, with v = 2 and u = 1/2.
    assert (np.abs(cusp.values - [np.exp(-2.0), 2.5]) <= cusp.errors).all() and (cusp.errors < 1e-12).all()


def test_a_zero_hopf_point_of_lorenz_84() -> None:
    branch = udd.continuation(udd.equilibria(LORENZ84)[0], "G", (0.0, 3.0))
    fold, hopf = (
        udd.locus(branch.find(kind)[0], "F", (0.0, 3.0), within=(0.0, 3.0)) for kind in ("fold", "Hopf")
    )
    (one,), (other,) = _of(fold, "zero-Hopf"), _of(hopf, "zero-Hopf")
    # A. Shil'nikov, G. Nicolis and C. Nicolis, Int. J. Bif. Chaos 5 (1995) 1701.
    assert one.values == pytest.approx([1.682969, 1.684052], abs=1e-6)
    assert (np.abs(one.values - other.values) <= one.errors + other.errors).all()
    assert one.coefficients["s"] == other.coefficients["s"] == 1.0
    assert one.coefficients["theta"] == pytest.approx(other.coefficients["theta"], abs=1e-9)
    assert "zero-Hopf at G = 1.68296855" in repr(one) and "zero-Hopf" in repr(hopf)


def test_the_second_lyapunov_coefficient_is_that_of_the_normal_form() -> None:
    # z' = (mu + 2 i) z + a z |z|^2 + 0.7 z |z|^4 with x + i y = z, in curved coordinates.
    x, y = "(u - 0.3*v^2)", "v"
    square = f"({x}^2 + v^2)"
    radial = f"(mu + a*{square} + 0.7*{square}^2)"
    fx, fy = f"({x}*{radial} - {y}*(2 - 0.5*{square}))", f"({y}*{radial} + {x}*(2 - 0.5*{square}))"
    model = udd.Model(["u", "v"], [f"{fx} + 0.6*v*{fy}", fy], {"mu": -0.1, "a": -0.4})
    (hopf,) = udd.continuation(udd.equilibria(model, near=[0.0, 0.0])[-1], "mu", (-0.5, 0.5)).find("Hopf")
    curve = udd.locus(hopf, "a", (-1.0, 1.0), within=(-0.5, 0.5))
    (bautin,) = _of(curve, "Bautin")
    assert (np.abs(bautin.values) <= bautin.errors + 1e-12).all()
    # The eigenvector has length 1, so that |z|^2 is twice its coefficient's; and over the frequency.
    assert bautin.coefficients["l2"] == pytest.approx(4 * 0.7 / 2.0, rel=1e-7)


def _far(t: float, s: np.ndarray) -> float:
    return float(40.0 - np.abs(s).max())


_far.terminal = True  # type: ignore[attr-defined]
PLANE = udd.Model(["x", "v"], ["v", "x^2 - m + v*(b + x)"], {"b": 0.85, "m": 1.0})


def test_homoclinic_orbits_are_followed_over_two_parameters() -> None:
    (one,) = udd.connections(PLANE, "b", (0.7, 0.8), n=2, t_max=8.0)
    curve = udd.locus(one, "m", (0.25, 1.5), within=(0.0, 2.0), ds=0.2)
    assert curve.kind == "homoclinic" and curve.ends == ("the bound 0.25", "the bound 1.5")
    assert curve.parameters == ("b", "m") and curve.values[0, 1] == 0.25 and curve.values[-1, 1] == 1.5
    assert all(one.error < 1e-9 for one in curve.solutions if isinstance(one, udd.Connection))
    # Next to the curve the unstable manifold passes the saddle on its two sides, by another integrator.
    b, m = curve.values[-1]
    saddle = np.sqrt(m)

    def end(b: float) -> float:
        growing = (b + saddle + np.sqrt((b + saddle) ** 2 + 8 * saddle)) / 2
        start = np.array([saddle, 0.0]) - 1e-6 * np.array([1.0, growing])
        run = integrate.solve_ivp(
            lambda t, s: [s[1], s[0] ** 2 - m + s[1] * (b + s[0])],
            [0.0, 60.0],
            start,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=_far,
        )
        return float(run.y[0, -1])

    assert {end(b + d) > 5.0 for d in (-1e-7, 1e-7)} == {False, True}
    # Towards the Bogdanov-Takens point at 0 it is b = 5/7 sqrt(m) + ..., of which the square root is exact.
    assert curve.values[0, 0] / np.sqrt(0.25) == pytest.approx(5 / 7, rel=0.3)


@pytest.mark.nightly  # test_homoclinic_orbits_are_followed_over_two_parameters follows another
def test_a_shilnikov_orbit_of_the_damped_model_leads_to_that_without_damping() -> None:
    connections = udd.connections(udd.DLE(3.38), "w", (3.37686, 3.37687), n=2, t_max=11.0)
    one = next(one for one in connections if one.kind == "homoclinic")
    curve = udd.locus(one, "B", (0.0, 0.001), within=(3.0, 4.0), ds=0.2)
    damped = curve.solutions[-1]
    assert curve.ends == ("the bound 0", "the bound 0.001") and isinstance(damped, udd.Connection)
    back = udd.locus(damped, "B", (0.0, 0.001), within=(3.0, 4.0), ds=0.2)
    assert back.values[0] == pytest.approx([3.3768624337325, 0.0], abs=1e-10)


def test_homoclinic_orbits_are_born_at_a_bogdanov_takens_point() -> None:
    rest = min(udd.equilibria(PLANE), key=lambda one: float(one.state[0]))
    (hopf,) = udd.continuation(rest, "b", (-1.0, 3.0)).find("Hopf")
    (point,) = udd.locus(hopf, "m", (-0.5, 2.0), within=(-1.0, 3.0)).points
    assert point.kind == "Bogdanov-Takens"
    assert point.values == pytest.approx([0.0, 0.0], abs=1e-12)
    # u' = v, v' = ... + u^2 + u v.
    assert point.coefficients == pytest.approx({"a": 1.0, "b": 1.0}, abs=1e-9)
    curve = udd.locus(point, bounds=(0.01, 0.5), within=(-1.0, 3.0), ds=0.2)
    assert curve.kind == "homoclinic" and curve.ends == ("the bound 0.01", "the bound 0.5")
    assert curve.values[0, 0] == pytest.approx(5 / 7 * 0.1, rel=0.01)


def test_folds_of_cycles_are_born_at_a_bautin_point() -> None:
    # r' = r (mu + a r^2 - 0.7 r^4) has its folds on mu = -a^2/2.8, for a above 0.
    square = "(x^2 + y^2)"
    radial = f"(mu + a*{square} - 0.7*{square}^2)"
    model = udd.Model(["x", "y"], [f"x*{radial} - 2*y", f"y*{radial} + 2*x"], {"mu": -0.1, "a": -0.4})
    (hopf,) = udd.continuation(udd.equilibria(model, near=[0.0, 0.0])[-1], "mu", (-0.5, 0.5)).find("Hopf")
    (point,) = udd.locus(hopf, "a", (-1.0, 1.0), within=(-0.5, 0.5)).points
    curve = udd.locus(point, bounds=(-1.0, 1.0), within=(-0.5, 0.5))
    assert curve.kind == "fold" and "a Bautin point" in curve.ends and "the bound 1" in curve.ends
    mu, a = curve.values.T
    np.testing.assert_allclose(mu, -(a**2) / 2.8, atol=1e-10)
    assert (a > 0.0).all() and len(curve) > 5
    with pytest.raises(udd.UddError, match="one over a, not mu"):
        udd.locus(point, "mu")


def test_a_saddle_node_on_an_invariant_circle_is_named() -> None:
    # On the unit circle the angle turns at the rate m + cos(angle).
    radial = "(1 - x^2 - y^2)"
    model = udd.Model(["x", "y"], [f"x*{radial} - y*(m + x)", f"y*{radial} + x*(m + x)"], {"m": 1.5})
    orbit = udd.periodic_orbit(model, [1.0, 0.0])
    assert orbit.period == pytest.approx(2 * np.pi / np.sqrt(1.5**2 - 1), abs=1e-10)
    branch = udd.continuation(orbit, "m", (0.5, 2.0), direction="down", max_period=200.0)
    snic = udd.connection(branch)
    assert snic.kind == "SNIC" and abs(snic.value - 1.0) <= snic.error < 1e-10
    assert snic.equilibrium.state == pytest.approx([-1.0, 0.0], abs=1e-6) and "SNIC" in repr(snic)


@pytest.fixture(scope="module")
def homoclinic() -> udd.Connection:
    """An orbit homoclinic to a saddle of Bazykin's model, near the fold of the saddle."""
    al, d = 0.4316712, 0.1928323
    model = BAZYKIN.with_parameters({"al": al, "d": d})
    pole = np.polynomial.Polynomial([1.0, al])
    cubic = np.polynomial.Polynomial([0, 1]) - pole - d * np.polynomial.Polynomial([1, -0.01]) * pole**2
    x = float(np.sort(cubic.roots().real)[1])
    rest = np.array([x, (1.0 - 0.01 * x) * (1.0 + al * x)])
    flow = flow_of(model, rest[np.newaxis])
    way = direction_alone(flow, flow.values, rest, 1.0)
    assert way is not None
    times, start = np.arange(0.0, 60.0, 0.5), rest - 1e-2 * flow.size * way.vector
    path = udd.simulate(model, times, start, method="auto").state
    last = 40 + int(np.argmin(np.linalg.norm((path[40:] - rest) / flow.size, axis=1)))
    nodes, index = path[: last + 1], flow.index("al")
    guess = ConnectingCurve.through(flow, flow.values, index, rest, np.ones(2), nodes, times[last])
    return found_by(*guess, "al")


def test_a_homoclinic_curve_passes_beside_the_fold_of_its_saddle(homoclinic: udd.Connection) -> None:
    # The curve was lost here: at a fixed parameter the saddle does not exist a step ahead.
    assert homoclinic.kind == "homoclinic" and homoclinic.value == pytest.approx(0.431671, abs=1e-5)
    curve = udd.locus(homoclinic, "d", (0.192, 0.1935), within=(0.4, 0.5), ds=0.5, ds_max=1.0)
    assert curve.ends == ("the bound 0.192", "the bound 0.1935") and len(curve) > 2
    assert all(isinstance(one, udd.Connection) and one.error < 1e-9 for one in curve.solutions)


def test_a_homoclinic_curve_begins_where_it_enters_the_bounds(homoclinic: udd.Connection) -> None:
    curve = udd.locus(homoclinic, "d", (0.193, 0.1931), within=(0.4, 0.5), ds=1.0, ds_max=1.0)
    assert curve.values[0, 1] == 0.193 and curve.values[-1, 1] == 0.1931
