"""Runs that are shorter than the smallest normal number, 2.2e-308, reach their end."""

from __future__ import annotations

import pytest

from own_process import output_of

SETUP = """
import numpy as np
import udd
dle = udd.DLE(1.0)
start = [1.0, 1.0, 0.1]
switching = udd.Disk(0.03, effects=[udd.effects.coulomb()])
"""


@pytest.mark.parametrize("end", ["1e-320", "5e-324", "2.3e-308"])
def test_runs_shorter_than_normal_numbers_end(end: str) -> None:
    code = f"""{SETUP}
for method in ("auto", "taylor", "dopri5", "dop853", "rodas"):
    run = udd.simulate(dle, {end}, start, method=method)
    assert run.outcome == "finished" and run.t[-1] == {end}, (method, run)
    assert np.array_equal(run.state[-1], start), (method, run.state)
    run = udd.simulate(switching, [0.0, {end}], [0.0, 1e-3, 0.04, 0.0], method="dop853", dense=True)
    assert run({end}).shape == (4,)
many = udd.ensemble(dle, {end}, np.ones((40, 3)))
assert (many.outcome == "finished").all() and (many.t_end == {end}).all()
print("done")
"""
    assert output_of(code) == "done\n"


def test_what_is_built_on_runs_takes_short_ones() -> None:
    code = f"""{SETUP}
spec = udd.SweepSpec("outcome", dle, {{"w": [1.0, 2.0]}}, start, {{"t": 1e-320}})
assert (udd.sweep(spec)["outcome"] == 0).all()
found = udd.covariant_vectors(dle, 3, dt=1e-320, transient=0.0, state0=start)
assert found.state.shape == (4, 3) and np.array_equal(found.state[-1], start)
print("done")
"""
    assert output_of(code) == "done\n"


def test_a_run_that_ends_a_hair_behind_its_last_step_ends() -> None:
    code = f"""{SETUP}
times = np.array([0.0, 1e-300, 1e-300 + 2e-316])
for method in ("auto", "dopri5", "dop853", "rodas"):
    assert udd.simulate(dle, times, start, method=method).outcome == "finished"
print("done")
"""
    assert output_of(code) == "done\n"
