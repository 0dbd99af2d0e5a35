"""Lists of equilibria: complete for polynomials, degenerate ones among them."""

from __future__ import annotations

import numpy as np
import pytest

import udd

SIR = udd.Model(["S", "I"], ["-b*S*I", "b*S*I - g*I"], {"b": 0.5, "g": 0.1})


@pytest.mark.parametrize(
    ("states", "equations"),
    [
        (["x", "y"], ["x^2", "-y"]),
        (["x"], ["-x^3"]),
        (["x", "y"], ["0.0*x - x^3", "-y"]),
        (["x", "y", "z"], ["1.2*y*z", "-1.9*y - 1.1*x^2 + 1.8*y*z", "-1.1*z - 1.7*y^2 + 1.5*y*z"]),
        (["x", "y"], ["sin(x)^2 + x^2", "-y"]),
    ],
)
def test_a_multiple_root_comes_once(states: list[str], equations: list[str]) -> None:
    for near in (None, [0.0] * len(states)):
        (rest,) = udd.equilibria(udd.Model(states, equations), near=near)
        assert rest.state.tolist() == [0.0] * len(states)
        assert rest.isolated and rest.kind == "degenerate"


def test_a_multiple_root_away_from_the_origin_is_known_to_rounding() -> None:
    # A fold at (x, y) = (1/3, 7/9): 9 (x - 1/3)^2 (x + 2) = 0.
    model = udd.Model(["x", "y"], ["9*x^3 + 12*x^2 - 11*x + 2", "y - x - 4/9"])
    rests = sorted(udd.equilibria(model), key=lambda rest: float(rest.state[0]))
    assert [rest.kind for rest in rests] == ["unstable node", "degenerate"]
    np.testing.assert_allclose([rest.state for rest in rests], [[-2, -14 / 9], [1 / 3, 7 / 9]], atol=1e-12)


def test_a_line_of_equilibria_is_not_isolated() -> None:
    result = udd.equilibria(SIR)
    assert result and all(rest.state[1] == 0.0 and not rest.isolated for rest in result)
    assert {rest.kind for rest in result} == {"not isolated"} and "not isolated" in result.search
    given = udd.equilibria(SIR, near=[0.3, 0.0])
    assert any(np.allclose(rest.state, [0.3, 0.0], atol=1e-12) for rest in given)


def test_a_list_says_whether_it_is_complete() -> None:
    wells = udd.Model(["x", "y", "z"], ["x - x^3", "y - y^3", "z - z^3"])
    result = udd.equilibria(wells)
    assert len(result) == 27
    assert result.search == "all isolated equilibria: a homotopy with 27 paths, the Bezout number"
    assert "others may exist" in udd.equilibria(udd.Model(["x"], ["exp(x) - 2"])).search


def test_quotients_of_polynomials_have_no_equilibria_at_poles() -> None:
    bazykin = udd.Model(
        ["x", "y"],
        ["x - x*y/(1 + al*x) - e*x^2", "-g*y + x*y/(1 + al*x) - d*y^2"],
        {"al": 0.2, "e": 0.01, "g": 1.0, "d": 0.1},
    )
    states = {tuple(rest.state.round(9) + 0.0) for rest in udd.equilibria(bazykin)}
    # One of the last two roots of the numerators is the pole x = -5.
    assert {(0.0, 0.0), (100.0, 0.0), (0.0, -10.0)} < states and len(states) == 4


@pytest.mark.parametrize("seed", range(6))
def test_no_equilibrium_of_a_random_quadratic_model_is_missed(seed: int) -> None:
    random = np.random.default_rng(seed)
    names = ["x", "y", "z"]
    terms = ["1", *names, *(f"{a}*{b}" for i, a in enumerate(names) for b in names[i:])]
    table = random.normal(size=(3, len(terms)))
    texts = [
        "+".join(f"({c!r})*{term}" for c, term in zip(row.tolist(), terms, strict=True)) for row in table
    ]
    model = udd.Model(names, texts)
    equilibria = udd.equilibria(model)
    states = np.array([rest.state for rest in equilibria]).reshape(-1, 3)
    assert (np.abs(model.rates(0.0, states)) < 1e-9 * (1 + np.abs(states).max(initial=0.0)) ** 2).all()
    # Newton's method from many states.
    x = 6.0 * random.normal(size=(400, 3))
    for _ in range(60):
        slopes = _slopes(table, x)
        values = model.rates(0.0, x)
        x = x - np.linalg.solve(slopes, values[:, :, None])[:, :, 0]
    good = x[np.abs(model.rates(0.0, x)).max(axis=1) < 1e-9 * (1 + np.abs(x).max(axis=1)) ** 2]
    for root in good:
        assert np.abs(states - root).max(axis=1).min() < 1e-6 * (1 + np.abs(root).max())
    assert len(equilibria) % 2 == 0 and len(equilibria) <= 8


def _slopes(table: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Derivatives (n, 3, 3) of the quadratic rates with this table of coefficients."""
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    slopes = np.broadcast_to(table[:, 1:4], (len(x), 3, 3)).copy()
    for k, (i, j) in enumerate(pairs):
        slopes[:, :, i] += table[:, 4 + k] * x[:, j, None]
        slopes[:, :, j] += table[:, 4 + k] * x[:, i, None]
    return slopes
