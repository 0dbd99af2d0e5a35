"""Ensembles: the same runs as one by one, whatever happens to them."""

from __future__ import annotations

import numpy as np
import pytest

import udd

STARTS = np.random.default_rng(3).normal(size=(4, 5, 3))


@pytest.mark.parametrize("method", ["taylor", "dopri5", "dop853"])
def test_its_runs_are_those_of_simulate(method):
    times = np.array([0.0, 2.0, 9.0])
    result = udd.ensemble(udd.DLE(1.0), times, STARTS, method=method)
    assert result.state.shape == (4, 5, 3, 3)
    assert (result.outcome == "finished").all()
    for i, j in ((0, 0), (3, 4)):
        single = udd.simulate(udd.DLE(1.0), times, STARTS[i, j], method=method)
        np.testing.assert_array_equal(result.state[i, j], single.state)
    np.testing.assert_array_equal(result.end, result.state[..., -1, :])


def test_the_number_of_threads_changes_no_bit():
    runs = [udd.ensemble(udd.DLE(3.9), 40.0, STARTS, threads=threads).end for threads in (1, 2, 5)]
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def test_parameters_vary():
    result = udd.ensemble(udd.DLE(1.0), 5.0, [1.0, 1.0, 0.01], parameters={"w": [0.5, 1.0, 2.0]})
    assert result.state.shape == (3, 1, 3)
    alone = udd.ensemble(udd.DLE(2.0), 5.0, [1.0, 1.0, 0.01])
    np.testing.assert_array_equal(result.end[2], alone.end)


def test_average_of_the_ensemble_is_the_exact_one():
    starts = np.random.default_rng(1).normal(size=(20_000, 3))
    end = udd.ensemble(udd.DLE(1.0), 60.0, starts, rtol=1e-6, atol=1e-9).end
    square = end[:, 0] ** 2
    # <omega^2> = w within four standard errors of the mean.
    assert abs(square.mean() - 1.0) < 4.0 * square.std() / np.sqrt(len(square))


def test_a_disk_that_leaves_says_so():
    disk = udd.Disk(0.045)
    # The first leaves after 5.8 s, before chaos could decide; the other rests above the axle.
    starts = np.array([[3.832, -0.003, -0.002, 0.0], [0.0, 0.0, 0.0, 0.0]])
    result = udd.ensemble(disk, np.linspace(0.0, 10.0, 5), starts)
    assert "ejected" in result.outcome
    left = result.outcome == "ejected"
    np.testing.assert_allclose(np.hypot(result.end[left, 1], result.end[left, 2]), disk.R, rtol=1e-9)
    assert np.isnan(result.state[left, -1]).all()
    assert (result.t_end[left] < 10.0).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"t": [0.0, 2.0, 1.0]}, "the times must increase"),
        ({"t": -1.0}, "t must not be below 0"),
        ({"t": 1.0, "method": "euler"}, "method must be one of"),
        ({"t": 1.0, "parameters": {"W": 1.0}}, "has no parameter 'W'"),
        ({"t": 1.0, "state0": [1.0, 2.0]}, "state0 must have the 3 components"),
        ({"t": 1.0, "threads": 0}, "threads must be a whole number"),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(udd.errors.ModelError, match=message):
        udd.ensemble(udd.DLE(1.0), **options)
