"""Functions that use several threads work in a process that was forked after them."""

from __future__ import annotations

import sys

import pytest

from own_process import output_of

SETUP = """
import multiprocessing
import warnings
import numpy as np
import udd
t = np.arange(0.0, 4.0, 0.02)
oscillator = udd.Model(["x", "v"], ["v", "-k*x - c*v"], {"k": 4.0, "c": 0.1})
truth = udd.simulate(oscillator, t, [1.0, 0.0])
measured = udd.Measurement(t, {"x": truth.x + 1e-3 * np.random.default_rng(1).normal(size=len(t))})
dle = udd.DLE(1.0)
"""

WORK = {
    "fit": "udd.fit(measured, oscillator).parameters['k']",
    "forecast": "udd.forecast(measured, oscillator, 2.0, members=8, rng=1).median[-1].tolist()",
    "simulate": "udd.simulate(dle, 5.0, [1, 1, 1]).state[-1].tolist()",
    "ensemble": "udd.ensemble(dle, 5.0, np.ones((64, 3))).end.sum()",
    "lyapunov": "udd.lyapunov(np.linspace(1.0, 2.0, 64), t=500.0, tol=0.5).sum()",
    "poincare": "udd.poincare(dle, n=20).state.sum()",
    "shooting": "udd.periodic_orbit(udd.DLE(9.0)).period",
    "covariant": "udd.covariant_vectors(dle, 20, transient=5.0).vectors.sum()",
    "basins": "udd.basins(udd.DLE(9.0), {'z': np.linspace(0, 1, 16)}, n=12, transient=12).attrs['section']",
}


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
@pytest.mark.parametrize("name", WORK)
def test_a_forked_process_works_on_threads(name: str) -> None:
    code = f"""{SETUP}
def work(_=0):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return {WORK[name]}
before = work()
with multiprocessing.get_context("fork").Pool(2) as pool:
    results = pool.map_async(work, range(2)).get(20)
assert results == [before, before], (before, results)
assert work() == before
print("done")
"""
    assert output_of(code, 60.0) == "done\n"


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
def test_a_child_of_a_forked_process_fits() -> None:
    code = f"""{SETUP}
import os
udd.fit(measured, oscillator)
def fork(depth):
    if depth and (child := os.fork()):
        assert os.waitpid(child, 0)[1] == 0
        return
    udd.fit(measured, oscillator)
    if depth:
        fork(depth - 1)
        os._exit(0)
fork(2)
print("done")
"""
    assert output_of(code, 60.0) == "done\n"
