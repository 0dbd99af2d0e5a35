"""Keyword arguments: the names that they had before, and those that several functions share."""

from __future__ import annotations

import importlib
import sys
import warnings

import pytest

import udd
from udd._util.keywords import renamed

RUN = udd.simulate(udd.Disk(0.04), 1.0, [0.0, 1e-3, 0.04, 0.0])


def test_a_name_of_before_works_with_a_warning() -> None:
    rest = udd.equilibria(udd.DLE(2.5, B=0.2), initial_states=8)[0]
    now = udd.continuation(rest, "w", (1.0, 9.0), ds=0.05, max_points=30)
    with pytest.warns(DeprecationWarning, match="called ds= now") as reported:
        before = udd.continuation(rest, "w", (1.0, 9.0), step=0.05, max_points=30)  # type: ignore[call-arg]
    assert reported[0].filename == __file__
    assert before.values.tolist() == now.values.tolist()


def test_both_names_at_once_are_refused() -> None:
    @renamed(old="new")
    def doubled(*, new: int) -> int:
        return 2 * new

    with pytest.raises(TypeError, match="both 'new' and 'old'"):
        doubled(new=1, old=2)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    "call",
    [
        lambda: udd.poincare(udd.DLE(1.0), n=1, tol=1e-9),  # type: ignore[call-arg]
        lambda: udd.basins(udd.DLE(4.5), {"y": [0.1]}, tol=1e-9),  # type: ignore[call-arg]
        lambda: udd.bifurcation(udd.DLE(1.0), "w", [1.0], tol=1e-9),  # type: ignore[call-arg]
        lambda: udd.render(RUN, "a.mp4", zoom=2.0),  # type: ignore[call-arg]
    ],
)
def test_an_option_that_there_is_not_is_named(call: object) -> None:
    with pytest.raises(TypeError, match=r"unexpected keyword argument '(tol|zoom)'"):
        call()  # type: ignore[operator]


def test_a_partial_result_is_warned_of_where_the_package_was_called() -> None:
    with warnings.catch_warnings(record=True) as reported:
        warnings.simplefilter("always")
        udd.errors.interrupted(lambda: None, "half is missing", partial=True)
    assert reported[0].filename == __file__


def test_attributes_and_modules_of_before_work_with_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    model = udd.DLE(1.0)
    with pytest.warns(DeprecationWarning, match="DLE.slow is called time_scale now") as reported:
        before = model.slow
    assert reported[0].filename == __file__ and before == model.time_scale
    with pytest.warns(DeprecationWarning, match="called udd.related_systems now"):
        assert udd.relatives is udd.related_systems
    monkeypatch.delitem(sys.modules, "udd.relatives", raising=False)
    with pytest.warns(DeprecationWarning, match="called udd.related_systems now"):
        again = importlib.import_module("udd.relatives")
    assert again.lorenz is udd.related_systems.lorenz


def test_an_unknown_argument_is_answered_with_all_that_there_are() -> None:
    with pytest.raises(TypeError, match=r"'state0'; its arguments are model, .*initial_states, .*rtol"):
        udd.bifurcation(udd.DLE(1.0), "w", [1.0, 2.0], state0=[1, 1, 0])


def test_a_model_without_a_usual_state_names_the_argument() -> None:
    swing = udd.Model(["x", "v"], {"x": "v", "v": "-x"}, {})
    with pytest.raises(udd.errors.ModelError, match="give state0="):
        udd.lyapunov(swing)
