"""Starts of states that are not seen."""

from __future__ import annotations

import json

import numpy as np
import pytest

import udd
from udd.cli import main
from udd.errors import FitError
from udd.fitting import record_of

EQUATIONS = ["s*(y - x)", "x*(r - z) - y", "x*y - b*z"]
KNOWN = udd.Model(["x", "y", "z"], EQUATIONS, {"s": 9.0, "r": 26.0, "b": 2.5})


def seen_x() -> udd.Measurement:
    """The first state of Lorenz's model alone."""
    t = np.arange(0, 12, 0.02)
    truth = udd.Model(["x", "y", "z"], EQUATIONS, {"s": 10.0, "r": 28.0, "b": 8 / 3})
    x = udd.simulate(truth, t, [-5.0, -6.0, 22.0]).state[:, 0]
    return udd.Measurement(t, {"x": x + 0.2 * np.random.default_rng(0).standard_normal(len(t))})


def test_a_start_of_hidden_states_leads_a_fit_to_them():
    lost = udd.fit(seen_x(), KNOWN)
    assert not lost.converged or lost.parameters["r"] > 40  # from zero it goes elsewhere
    result = udd.fit(seen_x(), KNOWN, state0={"y": -6.0, "z": 22.0})
    assert result.converged
    for name, true in {"s": 10.0, "r": 28.0, "b": 8 / 3}.items():
        assert abs(result.parameters[name] - true) < 4 * result.errors[name]


def test_of_several_measurements_each_may_have_its_own():
    twice = [seen_x(), seen_x()]
    starts = [{"z": 22.0}, {"z": 10.0}]
    record = record_of(twice, KNOWN, starts)
    first = [record.states[record.film == k][0, 2] for k in range(2)]
    assert first == [22.0, 10.0]
    with pytest.raises(FitError, match="got 2 measurements but 1 starts"):
        record_of(twice, KNOWN, starts[:1])


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ({"w": 1.0}, "state0 has 'w', but the states are x, y, z"),
        ({"z": "high"}, "the start value of z must be a finite number, not 'high'"),
        ([1.0], "state0 must be a table"),
    ],
)
def test_a_start_that_is_none_is_refused(start, said):
    with pytest.raises(FitError, match=said):
        udd.fit(seen_x(), KNOWN, state0=start)


def test_a_disk_needs_no_start():
    t = np.arange(100) / 25
    still = udd.Measurement(t, np.zeros((100, 3)))
    with pytest.raises(FitError, match="a model of your own"):
        udd.fit(still, udd.Disk(0.04), state0={"Omega": 1.0})


def test_the_file_of_a_model_may_say_where_hidden_states_start(tmp_path, capsys):
    model = {"states": ["x", "y", "z"], "equations": EQUATIONS, "parameters": dict(KNOWN.parameters)}
    (tmp_path / "model.json").write_text(json.dumps(model | {"state0": {"y": -6.0, "z": 22.0}}))
    measured = seen_x()
    rows = "\n".join(f"{t},{x}" for t, x in zip(measured.t, measured["x"], strict=True))
    (tmp_path / "x.csv").write_text("t,x\n" + rows + "\n")
    assert main(["fit", str(tmp_path / "x.csv"), "--model", str(tmp_path / "model.json"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parameters"]["r"]["value"] == pytest.approx(28.0, abs=0.5)
