"""Properties of every result: one line of text, and labelled arrays."""

from __future__ import annotations

import numpy as np
import pytest

import discovered
import udd


def test_results_are_one_line() -> None:
    actual = discovered.disk()
    many = udd.ensemble(udd.DLE(5.0), [0.0, 0.1], [[1, 1, 0], [2, 1, 0]])
    for result in (actual, actual.fit, actual.measurement, many, udd.simulate(udd.DLE(5.0), 1.0, [1, 1, 0])):
        assert len(repr(result)) < 400 and "\n" not in repr(result)
    assert repr(actual).startswith("<Discovery: effect identified: ")
    assert actual.effects[0].title in actual._repr_html_()
    errors = actual.error_before
    assert repr(errors).startswith(f"<Errors of {len(errors.samples)} free runs: median ")
    assert f" {errors.unit} at {errors.horizons[0]:.3g} s" in repr(errors)
    assert len(repr(errors)) < 400 and "\n" not in repr(errors)


def test_results_are_labelled_arrays() -> None:
    pytest.importorskip("xarray", reason="labelled arrays need the extra 'scale'")
    run = udd.simulate(udd.Disk(0.039), [0, 1], [0, 0.001, 0.04, 0])
    labelled = run.to_xarray()
    assert labelled.Omega.attrs == {"units": "rad/s"} and labelled.Y.attrs == {"units": "m"}
    assert np.array_equal(labelled.Z.values, run.Z) and np.array_equal(labelled.t.values, run.t)
    many = udd.ensemble(udd.DLE(5.0), [0.0, 0.1, 0.2], np.ones((4, 2, 3))).to_xarray()
    assert dict(many.sizes) == {"run_0": 4, "run_1": 2, "t": 3} and many.outcome.dims == ("run_0", "run_1")
    points = udd.poincare(udd.DLE(10.0), n=5, parameters={"w": [9.0, 10.0]})
    assert dict(points.to_xarray().sizes) == {"orbit": 2, "crossing": 5}
    measured = udd.Measurement([0.0, 0.1], {"theta": [0.2, 0.1]}, sigma={"theta": [0.01, 0.01]})
    table = measured.to_xarray().to_dataframe()
    assert table.sigma_theta.tolist() == [0.01, 0.01] and table.index.tolist() == [0.0, 0.1]
