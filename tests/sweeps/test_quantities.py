"""Rules for every quantity that can be swept; a new quantity is tested without another line."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.errors import ModelError
from udd.models.parameter_batch import default_state, parameter_batch
from udd.simulation.outcomes import EJECTED, FINISHED
from udd.sweeps.quantities import QUANTITIES


@pytest.fixture(params=QUANTITIES)
def quantity(request: pytest.FixtureRequest) -> str:
    return request.param


def _computed(quantity: str, model: udd.Disk | udd.DLE, parameter: str, values: list[float], threads: int):
    asked = QUANTITIES[quantity]
    rows = parameter_batch(model, {parameter: values}).rows()
    states = np.tile(default_state(model), (len(values), 1))
    return asked.variables(model), asked.run(model, rows, states, asked.options(model, {"t": 300.0}), threads)


def test_a_quantity_gives_what_it_lists(quantity: str) -> None:
    variables, result = _computed(quantity, udd.DLE(1.0), "w", [0.5, 1.0, 4.0], 1)
    assert set(result) == {v.name for v in variables} | {"outcome"}
    for variable in variables:
        assert result[variable.name].shape == (3, *(length for _, length in variable.dimensions))
        assert result[variable.name].dtype == np.dtype(variable.dtype)
        assert np.isfinite(result[variable.name]).all()
    assert (result["outcome"] == FINISHED).all()


def test_a_quantity_has_the_same_bits_on_one_thread_and_on_two(quantity: str) -> None:
    _, one = _computed(quantity, udd.DLE(1.0), "w", [0.5, 1.0, 4.0], 1)
    _, two = _computed(quantity, udd.DLE(1.0), "w", [0.5, 1.0, 4.0], 2)
    for name, values in one.items():
        np.testing.assert_array_equal(values, two[name])


def test_an_orbit_that_leaves_disturbs_no_other(quantity: str) -> None:
    # The middle disk starts off its wheels.
    disk = udd.Disk(0.039, effects=[udd.effects.relaxation(b=40.0)])
    asked, states = QUANTITIES[quantity], np.tile([0.0, 1e-3, 0.0, 0.0], (3, 1))
    rows = parameter_batch(disk, {"W": [0.03, 0.03, 0.03]}).rows()
    states[1, 1] = 0.09
    result = asked.run(disk, rows, states, asked.options(disk, {"t": 2.0}), 1)
    assert result["outcome"][1] == EJECTED
    for values in result.values():
        np.testing.assert_array_equal(values[0], values[2])


def test_an_option_that_there_is_not_is_refused_by_its_name(quantity: str) -> None:
    with pytest.raises(ModelError, match="no option 'nonsense'"):
        QUANTITIES[quantity].options(udd.DLE(1.0), {"t": 5.0, "nonsense": 1.0})
