"""Runs whose steps get ever shorter end with a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from own_process import output_of

SAKARYA = 'udd.Model(["x", "y", "z"], ["-x + y + y*z", "-x - y + a*x*z", "z - b*x*y"], {"a": 0.4, "b": 0.3})'
# The faster the first component grows, the faster the second one turns.
DRIFT = 'udd.Model(["x", "y"], ["0.5*x", "-y + sin(x)"], {})'


def spectrum_of(model: str, start: str) -> str:
    """Return what a spectrum with default arguments says, in a process that is ended after a minute."""
    code = f"""
import udd
try:
    print(udd.lyapunov_spectrum({model}, state0={start}).verdict)
except udd.errors.IntegrationError as error:
    print(error)
"""
    return output_of(code, 60.0)


def test_an_orbit_that_turns_ever_faster_ends_in_a_sentence() -> None:
    said = spectrum_of(SAKARYA, "[1.0, -1.0, 1.0]")
    assert said.startswith("there is no spectrum: the steps of the run have become so short by t = "), said
    assert len(said) < 300


def test_an_orbit_that_grows_while_its_steps_shrink_escapes() -> None:
    assert spectrum_of(DRIFT, "[0.1, 0.1]") == "escapes\n"


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
    spectrum = udd.lyapunov_spectrum(growing, t=500.0, state0=[1e-3, 1.0])
    assert np.allclose(spectrum.exponents, [0.5, -1.0], atol=1e-3)


def test_a_blow_up_escapes() -> None:
    assert udd.lyapunov_spectrum(udd.Model(["x"], ["x^2"], {}), state0=[1.0]).verdict == "escapes"
