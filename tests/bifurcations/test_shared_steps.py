"""The steps that all searches share: brackets, the secant method, convergence with its bound, and phases."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.bifurcations.locus_points import outside
from udd.bifurcations.manifold_search import Accuracy, brackets, converge, secant, until_it_stands
from udd.bifurcations.pseudo_arclength import CurvePoint, guess_at, zero_between
from udd.errors import ModelError


def test_only_neighbours_that_differ_are_solved() -> None:
    def solve(a: float, b: float) -> float:
        if a > 4.0:
            raise ModelError("no solution")
        return 0.5 * (a + b)

    marks = [-1.0, 1.0, None, -3.0, 3.0, 5.0, -5.0]
    assert brackets(marks, lambda a, b: a * b < 0.0, solve) == [0.0, 0.0]


def test_the_secant_method_carries_the_other_unknowns_along() -> None:
    def height(x: np.ndarray) -> tuple[float, np.ndarray]:
        # The other unknown settles on the square of the value.
        return x[0] ** 3 - 2.0, np.array([x[0], x[0] ** 2])

    value, other = secant(height, np.array([1.2, 0.0]), 0.5)
    assert value == pytest.approx(2.0 ** (1 / 3), rel=1e-13)
    assert other == pytest.approx(value**2, rel=1e-6)
    with pytest.raises(ModelError, match="does not settle"):
        secant(lambda x: (1.0 / (1.0 + x[0] ** 2), x), np.array([1.0]), 0.01)


@pytest.mark.parametrize(("per_distance", "per_tolerance"), [(0.0, 0.0), (3e-3, 0.0), (0.0, 2e-9)])
def test_the_bound_covers_what_distance_and_tolerance_change(
    per_distance: float, per_tolerance: float
) -> None:
    def solve(x: np.ndarray, rounds: int, step: float, accuracy: Accuracy) -> np.ndarray:
        return np.array([2.0 + 1e-3**rounds + per_distance * accuracy.away + per_tolerance * accuracy.loose])

    x, error, _ = converge(solve, np.array([2.1]), 0.1, Accuracy(1e-6))
    assert abs(x[0] - 2.0) <= error < 1e-6
    assert error > 9.0 * per_distance * 1e-6 + 98.0 * per_tolerance


def test_a_solution_is_improved_until_its_value_stands() -> None:
    # Newton's method for the square root of 2, with the rounds that it has seen.
    def improve(x: list[float], k: int, moved: float) -> list[float]:
        return [0.5 * (x[0] + 2.0 / x[0]), k]

    root, moved, rounds = until_it_stands([1.0, 0.0], improve, lambda x: x[0], np.nan, 20)
    assert root == [pytest.approx(2.0**0.5, rel=1e-15), rounds]
    assert rounds < 8 and moved < 1e-12
    assert until_it_stands([1.0, 0.0], improve, lambda x: x[0], np.nan, 2)[2] == 2


def test_a_tangent_leads_to_a_value_unless_the_parameter_stands() -> None:
    place = CurvePoint(np.array([1.0, 2.0]), np.array([0.6, 0.8]))
    assert guess_at(place, 2.4) == pytest.approx([1.3, 2.4])
    assert guess_at(place, 2.4, least=0.9) == pytest.approx([1.0, 2.4])
    assert guess_at(place.reversed(), 2.4) == pytest.approx([1.3, 2.4])


def test_parameters_outside_their_bounds_are_listed() -> None:
    box = np.array([[0.0, 1.0], [-1.0, np.inf]])
    assert outside(np.array([0.5, 3.0]), box) == []
    assert outside(np.array([1.5, -2.0]), box) == [(0, 1.0), (1, -1.0)]


def test_a_zero_comes_with_its_place() -> None:
    zero, place = zero_between(lambda x: (x * x - 0.5, f"at {x}"), 1.0)
    assert zero == pytest.approx(0.5**0.5, abs=1e-15) and place == f"at {zero}"
    with pytest.raises(ValueError, match="different signs"):
        zero_between(lambda x: (1.0 + x, x), 1.0)


def test_questions_leave_a_branch_as_it_is() -> None:
    branch = udd.continuation(udd.periodic_orbit(udd.DLE(7.2)), "w", (7.0, 7.3))
    (point,) = branch.points
    phases = [curve.reference.copy() for curve, _ in branch._places]  # type: ignore[union-attr]
    for value in (point.value - 1e-4, point.value + 1e-4, *branch.values):
        assert branch.at(float(value))
    for (curve, _), phase in zip(branch._places, phases, strict=True):
        assert np.array_equal(curve.reference, phase)  # type: ignore[union-attr]
