"""Runs whose steps get ever shorter end with a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from own_process import output_of
from udd.errors import IntegrationError

SAKARYA = 'udd.Model(["x", "y", "z"], ["-x + y + y*z", "-x - y + a*x*z", "z - b*x*y"], {"a": 0.4, "b": 0.3})'
# The faster the first component grows, the faster the second one turns.
DRIFT = 'udd.Model(["x", "y"], ["0.5*x", "-y + sin(x)"], {})'


@pytest.mark.parametrize(
    ("model", "start"), [(SAKARYA, "[1.0, -1.0, 1.0]"), (DRIFT, "[0.1, 0.1]")], ids=["turn", "drift"]
)
def test_a_spectrum_of_ever_shorter_steps_ends(model: str, start: str) -> None:
    code = f"""
import udd
try:
    udd.lyapunov_spectrum({model}, state0={start})
except udd.errors.IntegrationError as error:
    print(error)
"""
    said = output_of(code, 60.0)
    assert said.startswith("there is no spectrum: the steps of the run have become so short by t = "), said
    assert len(said) < 300


@pytest.mark.parametrize("law", ["1/t", "1/sqrt(t)", "1e300 + 0*x", "-1/t"])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "rodas"])
def test_an_infinite_rate_at_the_start_is_refused_by_every_method(law: str, method: str) -> None:
    code = f"""
import udd
try:
    run = udd.simulate(udd.Model(["x"], ["{law}"], {{}}), 1.0, [0.0], method="{method}")
    print(run.outcome, run.state[-1, 0])
except udd.errors.IntegrationError as error:
    print(error)
"""
    said = output_of(code, 20.0)
    if law.startswith("1e300"):
        outcome, value = said.split()
        assert outcome == "finished" and np.isclose(float(value), 1e300)
    else:
        assert said == "the integration failed: the state or its rate is not finite at t = 0\n", said


def test_exponents_of_motion_that_grows_are_found() -> None:
    growing = udd.Model(["x", "y"], ["0.5*x", "-y"], {})
    found = udd.lyapunov_spectrum(growing, t=500.0, state0=[1e-3, 1.0])
    assert np.allclose(found.exponents, [0.5, -1.0], atol=1e-3)


def test_a_blow_up_is_said() -> None:
    with pytest.raises(IntegrationError):
        udd.lyapunov_spectrum(udd.Model(["x"], ["x^2"], {}), state0=[1.0])
