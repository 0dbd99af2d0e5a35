"""Bifurcations and ends of branches of cycles, against values to 36 digits or published ones."""

from __future__ import annotations

import numpy as np
import pytest

import tutorial_models
import udd
from tutorial_models import BRUSSELATOR, FITZHUGH, LORENZ84, LURE, ROESSLER, SEASONS

MORRIS_LECAR = tutorial_models.MORRIS_LECAR.with_parameters({"I": 60.0})
REACTOR = udd.Model(
    ["x1", "x2"],
    ["-x1 + Da*(1 - x1)*exp(x2)", "-x2 + B*Da*(1 - x1)*exp(x2) - beta*x2"],
    {"B": 7.06, "beta": 0.74, "Da": 0.15},
)


def _points(branch: udd.Branch) -> list[tuple[str, float]]:
    return sorted(((point.kind, point.value) for point in branch.points), key=lambda point: point[1])


def test_cycles_pass_both_folds_between_two_hopf_points() -> None:
    rest = udd.equilibria(MORRIS_LECAR, near=[-60.0, 0.01])[0]
    first, last = udd.continuation(rest, "I", (0.0, 300.0)).find("Hopf")
    branch = udd.continuation(first, bounds=(0.0, 300.0))
    folds = [point for point in branch.points if point.kind == "fold"]
    assert abs(folds[1].value - 216.89980138941132) <= folds[1].error
    assert [round(fold.value, 3) for fold in folds] == [88.293, 216.9]
    # The test of the reactor goes from either end to the other one.
    hopf = branch.points[-1]
    assert len(branch.points) == 3 and hopf.kind == "Hopf"
    assert abs(hopf.value - last.value) <= hopf.error + last.error
    assert branch.ends[1].startswith("a Hopf bifurcation at")


def test_the_stirred_reactors_cycles_go_from_one_hopf_point_to_the_other() -> None:
    rest = udd.equilibria(REACTOR, near=[0.4, 2.0])[0]
    hopfs = udd.continuation(rest, "Da", (0.05, 0.3)).find("Hopf")
    first, last = sorted(hopfs, key=lambda point: point.value)
    for start, end in ((first, last), (last, first)):
        cycles = udd.continuation(start, bounds=(0.05, 0.3))
        assert cycles.points[-1].kind == "Hopf" and cycles.find("period doubling") == []
        assert abs(cycles.points[-1].value - end.value) <= cycles.points[-1].error + end.error
        # No cycle comes twice: at each value of the stable part there is one with the known period.
        periods = {0.1319: 14.227516, 0.1321: 12.985259, 0.1323: 11.959424}
        for value, period in periods.items():
            (orbit,) = [one for one in cycles.at(value) if one.stable]
            assert orbit.period == pytest.approx(period, abs=1e-6)


@pytest.mark.parametrize(
    ("model", "start", "parameter", "known"),
    [
        (LORENZ84, [1.0, 0.0, 1.0], "F", 1.027845271021219),
        (BRUSSELATOR, [1.0, 2.0], "b", 2.69),
        (ROESSLER, [1.0, 2.0, 0.0], "c", 1.3056067738349),
        (FITZHUGH, [1.0, 0.0], "I", 0.3312813374547458),
    ],
)
def test_cycles_that_shrink_end_in_a_hopf_point(
    model: udd.Model, start: list[float], parameter: str, known: float
) -> None:
    orbit = udd.periodic_orbit(model, start, settle=200.0)
    branch = udd.continuation(orbit, parameter, direction="down")
    (hopf,) = branch.find("Hopf")
    assert hopf is branch.points[-1] and isinstance(hopf.solution, udd.Equilibrium)
    assert abs(hopf.value - known) <= hopf.error + 1e-13 * abs(known) and hopf.error < 1e-11
    assert branch.ends[1] == f"a Hopf bifurcation at {hopf.value:.10g}"
    # The last cycle is the smallest, with the period of those that are born there.
    low, high = branch.extremes
    assert np.argmin((high - low)[:, 0]) == len(branch) - 1
    assert branch.periods[-1] == pytest.approx(hopf.period, rel=0.02)
    # From the point the same cycles.
    again = udd.continuation(hopf, max_points=3)
    assert again.kind == "cycle" and again.periods[0] == pytest.approx(hopf.period, rel=0.02)


def test_doublings_on_the_way_to_the_other_hopf_point_come_once() -> None:
    rest = min(udd.equilibria(LURE), key=lambda one: abs(float(one.state[0])))
    (hopf,) = udd.continuation(rest, "al", (-2.0, 2.0)).find("Hopf")
    cycles = udd.continuation(hopf, bounds=(-2.0, 2.0))
    kinds, values = zip(*_points(cycles), strict=True)
    assert kinds == ("Hopf", "period doubling", "period doubling")
    assert values == pytest.approx([-1.0, -0.630302006, 0.630302006], abs=1e-8)


@pytest.mark.parametrize("current", [0.0, 1.0, 60.0])
def test_a_branch_does_not_depend_on_where_its_parameter_starts(current: float) -> None:
    rest = udd.equilibria(MORRIS_LECAR.with_parameters({"I": current}), near=[-60.0, 0.01])[0]
    branch = udd.continuation(rest, "I", (0.0, 300.0))
    assert [point.kind for point in branch.points] == ["Hopf", "Hopf"]
    assert [point.value for point in branch.points] == pytest.approx([93.857618374, 212.018816100], abs=1e-8)
    assert len(branch) < 100 and branch.ends[1] == "I = 300"


def test_a_closed_branch_has_each_fold_once() -> None:
    orbit = udd.periodic_orbit(SEASONS, [0.5, 0.2, 1.0, 0.0], settle=100.0, max_period=5.0)
    for direction in ("both", "up", "down"):
        branch = udd.continuation(orbit, "b0", (0.1, 0.5), direction=direction)
        kinds, values = zip(*_points(branch), strict=True)
        assert kinds == ("fold", "fold") and values == pytest.approx([0.22130, 0.33999], abs=1e-5)
        assert branch.ends == ("the branch is closed",) * 2


def test_a_closed_branch_of_equilibria_ends_where_it_began() -> None:
    # x^2 + r^2 = 1.
    model = udd.Model(["x", "y"], ["x^2 + r^2 - 1", "-y"], {"r": 0.3})
    branch = udd.continuation(udd.equilibria(model)[0], "r", (-2.0, 2.0))
    assert _points(branch) == [("fold", pytest.approx(-1.0)), ("fold", pytest.approx(1.0))]
    assert branch.ends == ("the branch is closed",) * 2


def test_the_trivial_branch_is_followed_from_a_state_that_rounding_left() -> None:
    chua = udd.Model(["x", "y", "z"], ["a*(y - x^3/16 + x/6)", "x - y + z", "-b*y"], {"a": 5.0, "b": 14.0})
    (origin,) = [rest for rest in udd.equilibria(chua) if abs(rest.state[0]) < 1e-6]
    assert origin.state.tolist() == [0.0, 0.0, 0.0]
    branch = udd.continuation(origin, "a", (1.0, 12.0))
    assert branch.ends == ("a = 1", "a = 12") and np.abs(branch.states).max() == 0.0
    # As a search left it before: a number that is 0 but for the last bit.
    tiny = udd.equilibria(chua, near=[-5e-324, 0.0, 0.0])
    assert any(rest.state.tolist() == [0.0, 0.0, 0.0] for rest in tiny)
