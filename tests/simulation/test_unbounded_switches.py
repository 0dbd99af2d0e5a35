"""Switches whose function is infinite or no number, on one side or everywhere: runs end, and hear Ctrl-C."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import udd
from own_process import output_of
from udd.errors import IntegrationError

METHODS = ["dopri5", "dop853", "taylor", "rodas", "auto"]

RUNS = """
import sys, udd
for method in {methods}:
    model = udd.Model(["x", "v"], [{law!r}, "t"])
    try:
        run = udd.simulate(model, 0.1, [1.0, 2.8], method=method)
        print(method, run.outcome, *run.state[-1])
    except udd.errors.IntegrationError as error:
        print(method, "refused")
"""

#: Laws with their value, which is constant in the run; None if there is none.
CONSTANT: dict[str, float | None] = {
    "max(-exp(1000+t), 1)": 1.0,
    "min(exp(1000+t), 1)": 1.0,
    "max(1, -exp(1000+t))": 1.0,
    "where(exp(1000+t) > 0, 1, 2)": 1.0,
    "where(x - exp(1000+t) > 0, 1, 2)": 2.0,
    "sign(exp(1000+t))": 1.0,
    "where(abs(exp(1000+t)) > 1, 1, 2)": 1.0,
    "abs(exp(1000+t))": None,
    "max(1e300*exp(t)*1e300, 1)": None,
    "where(ln(-1-t) > 0, 1, 2)": 2.0,
    "where(0*exp(1000+t) > 0, 1, 2)": 2.0,
    # Finite at every place, but with no interval around it in which it is.
    "max(sqrt(x - x) - 1, 2)": 2.0,
    "where(sqrt(1 - x*0 - 1) + 1 > 0, 1, 2)": 1.0,
    "where(1e308*cos(t) - 1e308*sin(t) > 0, 1, 2)": 1.0,
}


@pytest.mark.parametrize("law", CONSTANT)
def test_a_switch_without_finite_values_ends_in_a_result_or_a_refusal(law: str) -> None:
    lines = output_of(RUNS.format(law=law, methods=METHODS), 60.0).splitlines()
    assert [line.split()[0] for line in lines] == METHODS
    for line in lines:
        outcome, *state = line.split()[1:]
        rate = CONSTANT[law]
        if rate is None:
            assert outcome == "refused"
        else:
            assert outcome == "finished"
            assert np.allclose([float(x) for x in state], [1.0 + 0.1 * rate, 2.8 + 0.005], rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("condition", "switch"),
    [
        ("exp(exp(10*t)) - 1e300 > 0", np.log(np.log(1e300)) / 10),  # grows beyond all numbers
        ("1e300*(1 - t)*1e300 < 0", 1.0),  # from plus infinity to minus infinity
        ("1e300*(t - 1)^3*1e300 > 0", 1.0),
        ("ln(t - 0.7) + 1 > 0", 0.7 + np.exp(-1.0)),  # no number until then
    ],
)
def test_a_switch_that_becomes_infinite_is_located(method: str, condition: str, switch: float) -> None:
    model = udd.Model(["x"], [f"where({condition}, 1, 0)"])
    run = udd.simulate(model, 2.0, [0.0], method=method)
    assert run.outcome == "finished" and run.state[-1, 0] == pytest.approx(2.0 - switch, abs=1e-6)


def test_ensembles_and_sections_of_such_laws_end() -> None:
    code = """
import numpy as np, udd
model = udd.Model(["x", "v"], ["v", "-x + max(-exp(1000+t), 0.1)"])
runs = udd.ensemble(model, 5.0, np.ones((5, 2)))
print(runs.outcome)
for function in ("v*exp(1000+t)", "max(-exp(1000+t), v)", "ln(-1-t) - v", "v + 0*exp(1000+t)"):
    print(udd.poincare(model, function, 5, state0=[1.0, 0.0], transient=0, t_max=30.0).found)
udd.lyapunov(model, t=20.0, state0=[1.0, 0.0])
print("done")
"""
    assert output_of(code, 60.0).splitlines()[-1] == "done"


DEAF = """
import signal, time, udd
{setup}
signal.signal(signal.SIGPROF, signal.default_int_handler)
signal.setitimer(signal.ITIMER_PROF, 0.5)  # of this process, however busy the machine is
try:
    {call}
    print("ended")
except KeyboardInterrupt:
    print(time.process_time())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("method", METHODS)
def test_a_search_for_countless_switches_hears_ctrl_c(method: str) -> None:
    setup = 'model = udd.Model(["x"], ["max(sin(1e9*t)*cos(1e9*t^2) - 2, max(sin(3e9*t^3) - 3, 1))"])'
    call = f"udd.simulate(model, 1e3, [0.0], method={method!r})"
    printed = output_of(DEAF.format(setup=setup, call=call), 60.0).split()
    assert printed == ["ended"] or float(printed[0]) < 3.0


def test_the_sign_of_a_parameter_that_is_zero_is_zero() -> None:
    for zero in (0.0, -0.0):
        model = udd.Model(["x"], ["2 + sign(a) + 4*sign(-a) + 8*sign(2*a*b)"], {"a": zero, "b": 1.0})
        for method in METHODS:
            assert udd.simulate(model, 1.0, [0.0], method=method).state[-1, 0] == pytest.approx(2.0)
        assert model.rates(0.0, [0.0])[0] == 2.0
        for a in (0.5, -0.5):
            other = model.with_parameters({"a": a})
            assert other.rates(0.0, [0.0])[0] == 2 + np.sign(a) * 5


def test_a_sign_where_its_state_is_zero_is_zero() -> None:
    model = udd.Model(["x", "v"], ["sign(x)", "sign(t*x*v) + where(x >= 0, 8, 0) + where(x > 0, 4, 0)"])
    for zero in (0.0, -0.0):
        assert model.rates(1.0, [zero, 1.0]).tolist() == [0.0, 8.0]
    assert model.rates(1.0, [1e-300, 1.0]).tolist() == [1.0, 13.0]
    assert model.rates(1.0, [-1e-300, 1.0]).tolist() == [-1.0, -1.0]


@pytest.mark.parametrize(("condition", "rate"), [("n >= 2", 1), ("n > 2", 0), ("n <= 2", 1), ("2 < n", 0)])
def test_a_parameter_that_equals_its_bound_counts_by_the_comparison(condition: str, rate: float) -> None:
    model = udd.Model(["x"], [f"where({condition}, 1, 0)"], {"n": 2.0})
    assert model.rates(0.0, [0.0])[0] == rate
    assert udd.simulate(model, 1.0, [0.0]).state[-1, 0] == pytest.approx(rate)


def test_a_blow_up_at_the_switch_is_refused() -> None:
    with pytest.raises(IntegrationError, match=r"finite|series|step size"):
        udd.simulate(udd.Model(["x"], ["max(exp(1000 + t), x)"]), 1.0, [0.0])
