"""Runs: reference states, an independent integrator, events, the edge, interrupts, bad input."""

from __future__ import annotations

import math
import os
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import udd
from own_process import memory_error_of
from udd import effects
from udd.errors import IncompleteWarning, IntegrationError, UddError

TIGHT = {"rtol": 1e-15, "atol": 1e-15}
KINK = (0.103 - 0.012) / 0.055
START = [0.0, 1e-3, 0.04, 0.0]


@pytest.mark.parametrize(
    ("w", "b", "start", "t", "wanted"),
    [
        (1.0, 0.0, [1, 1, 0.01], 10, [0.97664030875, 0.98317480213, 0.04343309237]),
        (1.0, 0.0, [1, 1, 0.01], 30, [0.32011311025, -0.38840279112, -0.23230343728]),
        (7.1, 0.0, [1, 1, 0.01], 10, [2.73182986436, -3.08519098040, -3.12651694271]),
        (3.7, 0.2, [3.7**0.5, 3.7**0.5, -3.2], 10, [0.76514351119, 1.60344735353, 3.21882737548]),
        (3.7, 0.2, [3.7**0.5, 3.7**0.5, -3.2], 100, [1.71475462137, 0.53438908815, -0.05743429282]),
    ],
)
def test_reference_states_of_the_dle(w, b, start, t, wanted) -> None:  # type: ignore[no-untyped-def]
    run = udd.simulate(udd.DLE(w, b), [0, t], start, **TIGHT)
    # To the digits given. By t = 100 the flow has amplified the rounding of 5e4 steps to 2e-11.
    np.testing.assert_allclose(run.state[-1], wanted, atol=3e-11 if t == 100 else 1e-11, rtol=0)


def test_reference_states_of_the_full_model() -> None:
    run = udd.simulate(udd.Disk(0.014), [0, 1], START, **TIGHT)
    np.testing.assert_allclose(run.state[-1, 0], 14.9706688195, atol=1e-10, rtol=0)
    np.testing.assert_allclose(run.state[-1, 1:3], [0.004251571054, -0.050389104409], atol=1e-12, rtol=0)
    run = udd.simulate(udd.Disk(0.088), [0, 5], [3, 0.005, 0, 0], **TIGHT)
    np.testing.assert_allclose(run.state[-1, 0], -12.75829282, atol=1e-8, rtol=0)
    np.testing.assert_allclose(run.state[-1, 1:3], [0.000867902072, -0.024075474092], atol=1e-12, rtol=0)


def test_turning_points_without_drive() -> None:
    theta, radius = math.radians(127), 0.058
    start = [0.0, radius * math.sin(theta), radius * math.cos(theta), 0.0]
    run = udd.simulate(udd.Disk(0.0), 2.3, start, **TIGHT)
    turns = run.events.of("reversal")
    wanted_t = [0.353385, 0.699102, 1.041013, 1.381645, 1.725801, 2.198271]
    wanted_y = [-0.0355556, 0.0264675, -0.0191920, 0.0131979, -0.0051802, 0.000173]
    # To the digits given, the last of which may be rounded.
    np.testing.assert_allclose(turns.t, wanted_t, atol=1e-6, rtol=0)
    np.testing.assert_allclose(turns.state[:5, 1], wanted_y[:5], atol=1e-7, rtol=0)
    np.testing.assert_allclose(turns.state[5, 1], wanted_y[5], atol=1e-6, rtol=0)


def all_effects() -> list[effects.Effect]:
    """Every effect in each way it can enter, at an amplitude that shows."""
    sizes = {"relaxation": 5.0, "slip": 0.3, "lateral_slip": 0.3, "cubic_drag": 1e-5, "quadratic_drag": 1e-4}
    result = []
    for spec in effects.library():
        if "disk" not in spec.bodies:
            continue
        for momentum in spec.momenta or (None,):
            size = {p.name: sizes.get(spec.name, 3e-3) for p in spec.parameters if p.role == "amplitude"}
            result.append(spec.make(momentum=momentum, **size))
    return result


MODELS = [
    (udd.DLE(3.7, 0.2), [1.9, 1.9, -3.2], 20.0),
    (udd.Pendulum(0.5, k0=0.01), [0.0, 2.0], 10.0),
    (udd.Disk(0.088), [3.0, 0.005, 0.0, 0.0], 3.0),
    (udd.Pendulum(0.5, k0=0.01, effects=effects.coulomb(c=0.02)), [0.0, 1.0], 3.0),
    (udd.Pendulum(0.5, k0=0.01, effects=effects.load_coulomb(f=0.02)), [0.0, 2.0], 3.0),
    (udd.Pendulum(0.5, k0=0.01, effects=effects.local_brake(a=0.05, c=0.1, s=0.1)), [0.0, 1.0], 3.0),
    *((udd.Disk(0.039, effects=[effect]), START, 0.6) for effect in all_effects()),
]


@pytest.mark.parametrize(
    ("model", "start", "end"), MODELS, ids=lambda v: repr(v) if isinstance(v, udd.models.Model) else ""
)
def test_an_independent_integrator_agrees(model, start, end) -> None:  # type: ignore[no-untyped-def]
    t = np.linspace(0, end, 41)
    ours = udd.simulate(model, t, start, rtol=1e-11, atol=1e-13)
    assert ours.outcome == "finished"
    # DOP853 does not know of the kinks: a short longest step bounds what it loses there.
    other = solve_ivp(model.rates, (0, end), start, "DOP853", t, rtol=1e-11, atol=1e-13, max_step=end / 600)
    np.testing.assert_allclose(ours.state, other.y.T, rtol=1e-6, atol=2e-7)


def test_accepted_steps_samples_and_dense_output_agree() -> None:
    model, start = udd.Disk(0.088), [3.0, 0.005, 0.0, 0.0]
    steps = udd.simulate(model, 2.0, start, method="dopri5", dense=True)
    assert steps.t[0] == 0.0 and steps.t[-1] == 2.0 and (np.diff(steps.t) > 0).all()
    assert len(steps.t) == steps.stats.accepted + 1
    np.testing.assert_allclose(steps(steps.t), steps.state, rtol=1e-14, atol=1e-15)
    t = np.linspace(0, 2, 333)
    sampled = udd.simulate(model, t, start, method="dopri5")
    assert sampled.stats == steps.stats, "sampling must not change the steps"
    np.testing.assert_allclose(steps(t), sampled.state, rtol=1e-14, atol=1e-15)
    assert steps(1.0).shape == (4,) and steps(t.reshape(9, 37)).shape == (9, 37, 4)
    # Between the steps the polynomial is about as accurate as the steps are: 1e-9 of the state.
    exact = udd.simulate(model, t, start, **TIGHT).state
    np.testing.assert_allclose(sampled.state, exact, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("model", "start", "method"),
    [
        (udd.DLE(1.0), [1.0, 1.0, 0.01], "taylor"),
        (udd.Disk(0.039), [0.0, 0.001, 0.04, 0.0], "taylor"),
        (udd.Model(["x", "v"], ["v", "where(sin(x) > v*x, -x, -2*x)"]), [1.0, 0.0], "taylor"),
        (udd.Model(["x", "v"], ["v", "-atan2(x, 2 + v)"]), [1.0, 0.0], "dop853"),
        (udd.Model(["x"], ["-1e5*(x - cos(t))"]), [0.0], "rodas"),
    ],
)
def test_the_default_says_which_method_ran(model: udd.models.Model, start: list[float], method: str) -> None:
    run = udd.simulate(model, [0.0, 2.0], start)
    assert run.stats.method == method
    again = udd.simulate(model, [0.0, 2.0], start, method=method)
    assert again.stats.method == method
    np.testing.assert_allclose(run.state[-1], again.state[-1], rtol=1e-7, atol=1e-9)


def test_the_long_steps_of_a_series_are_shown_within() -> None:
    model, start = udd.DLE(1.0), [1.0, 1.0, 0.01]
    run, ends = udd.simulate(model, 20.0, start), udd.simulate(model, 20.0, start, method="taylor")
    assert run.stats == ends.stats and len(ends.t) == ends.stats.accepted + 1
    assert len(run.t) == 8 * run.stats.accepted + 1 and (np.diff(run.t) > 0).all()
    np.testing.assert_array_equal(run.state[::8], ends.state)
    exact = udd.simulate(model, run.t, start, **TIGHT).state
    np.testing.assert_allclose(run.state, exact, rtol=1e-6, atol=1e-6)


def test_the_interpolation_error_is_of_order_4() -> None:
    """Between steps the error falls with the tolerance as the step size's fifth power does."""
    model, start = udd.DLE(1.0), [1.0, 1.0, 0.01]
    exact = udd.simulate(model, 20.0, start, **TIGHT, dense=True)
    t = np.linspace(0, 5, 1001)
    sizes, errors = [], []
    for rtol in (1e-6, 1e-7, 1e-8, 1e-9):
        run = udd.simulate(model, 5.0, start, rtol=rtol, atol=rtol, method="dopri5", dense=True)
        sizes.append(5.0 / run.stats.accepted)
        errors.append(np.abs(run(t) - exact(t)).max())
    # The global error of steps and polynomial together: at least order 4, at most 5.
    slope = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert 3.9 < slope < 5.6


def test_events_lie_on_their_surfaces() -> None:
    run = udd.simulate(udd.Disk(0.088), np.linspace(0, 20, 11), [3.0, 0.005, 0.0, 0.0])
    turns, kinks = run.events.of("reversal"), run.events.of("friction kink")
    assert len(turns) > 10 and len(kinks) > 20 and len(turns) + len(kinks) == len(run.events)
    assert np.abs(turns.state[:, 0]).max() < 1e-12
    assert np.abs(np.abs(kinks.state[:, 0]) - KINK).max() < 1e-12
    assert (np.diff(run.events.t) > 0).all()
    first = run.events[0]
    assert (first.kind, first.t) == (run.events.kind[0], run.events.t[0])
    assert [event.kind for event in run.events] == list(run.events.kind)


def test_a_disk_that_leaves_its_wheels_is_ejected() -> None:
    t = np.arange(0, 200, 0.04)
    start = [3.832, -0.003, -0.002, 0.0]  # leaves after 5.8 s, before chaos could decide
    with pytest.warns(IncompleteWarning, match=r"left the wheels at t = 5\.8\d+ s.*edge=\"ignore\"") as told:
        run = udd.simulate(udd.Disk(0.045), t, start)
    assert len(told) == 1
    assert run.outcome == "ejected" and run.t[-1] < 60
    assert abs(np.hypot(run.Y[-1], run.Z[-1]) / 0.08 - 1) < 1e-12
    assert run.events[-1].kind == "edge" and run.events[-1].t == run.t[-1]
    np.testing.assert_array_equal(run.events[-1].state, run.state[-1])
    np.testing.assert_array_equal(run.t[:-1], t[: len(run.t) - 1])
    assert (np.hypot(run.Y, run.Z)[:-1] < 0.08).all()
    beyond = udd.simulate(udd.Disk(0.045, edge="ignore"), t[: len(run.t) + 20], start)
    assert beyond.outcome == "finished"
    # The same steps up to the edge.
    np.testing.assert_array_equal(beyond.state[: len(run.t) - 5], run.state[:-5])
    assert np.hypot(beyond.Y, beyond.Z).max() > 0.08


def test_components_are_attributes() -> None:
    run = udd.simulate(udd.Disk(0.039), [0, 0.5, 1], START)
    for i, name in enumerate(("Omega", "Y", "Z", "beta")):
        np.testing.assert_array_equal(getattr(run, name), run.state[:, i])
    with pytest.raises(AttributeError, match="theta"):
        run.theta  # noqa: B018
    assert pickle.loads(pickle.dumps(run)).model == run.model


def test_the_symmetry_of_the_disk_holds_to_the_last_bit() -> None:
    t, mirror = np.linspace(0, 10, 21), np.array([-1, -1, 1, -1])
    start = np.array([3.0, 0.005, 0.01, 0.5])
    run, mirrored = (udd.simulate(udd.Disk(0.088), t, x) for x in (start, mirror * start))
    np.testing.assert_array_equal(mirrored.state, run.state * mirror)


@pytest.mark.parametrize(("w", "period"), [(7.1, 3.98808575286), (10.0, 3.35832224912)])
def test_periodic_orbits_of_the_dle_close_after_their_period(w: float, period: float) -> None:
    # At 7.1 the approach takes a time of 2250 per factor e; 40000 leaves 2e-8.
    settle = 200.0 if w == 10.0 else 40000.0
    start = udd.simulate(udd.DLE(w), [0, settle], [1, 1, 0.01], rtol=1e-11, atol=1e-12).state[-1]
    loop = udd.simulate(udd.DLE(w), [0, period / 2, period], start, **TIGHT)
    np.testing.assert_allclose(loop.state[2], start, atol=2e-6)
    np.testing.assert_allclose(loop.state[1], start * [-1, -1, 1], atol=2e-6)


def test_periodic_orbit_of_the_full_model() -> None:
    model = udd.Disk(0.071)
    start = udd.simulate(model, [0, 400.0], [3.0, 0.005, 0.0, 0.0], rtol=1e-10, atol=1e-13).state[-1]
    loop = udd.simulate(model, [0, 1.384045926], start, **TIGHT).state[-1]
    np.testing.assert_allclose(loop[:3], start[:3], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: udd.simulate(udd.DLE(1.0), [0, 1, 1], [1, 1, 1]), "times must increase"),
        (lambda: udd.simulate(udd.DLE(1.0), [0, 2, 1], [1, 1, 1]), "times must increase"),
        (lambda: udd.simulate(udd.DLE(1.0), [0, math.nan], [1, 1, 1]), "t must be finite"),
        (lambda: udd.simulate(udd.DLE(1.0), [], [1, 1, 1]), "list of times"),
        (lambda: udd.simulate(udd.DLE(1.0), [[0, 1]], [1, 1, 1]), "list of times"),
        (lambda: udd.simulate(udd.DLE(1.0), -1.0, [1, 1, 1]), "t must not be below 0"),
        (lambda: udd.simulate(udd.DLE(1.0), "soon", [1, 1, 1]), "t must be numbers"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1]), "3 components"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, math.inf]), "state0 must be finite"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1], rtol=1e-16), "rtol must not be below"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1], atol=0), "atol must be above 0"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1], method="rk4"), "method must be"),
        (lambda: udd.simulate(1.0, 1.0, [1, 1, 1]), "a model is needed"),
        (lambda: udd.simulate(udd.Disk(0.039), 1.0, [0, 0.08, 0.01, 0]), "outside the disk"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1])(0.5), "no dense output"),
        (lambda: udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1], dense=True)(1.5), "outside the run"),
    ],
)
def test_bad_input_gets_one_clear_sentence(call, named) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(UddError) as caught:
        call()
    assert named in str(caught.value) and "\n" not in str(caught.value)


def test_a_solution_that_blows_up_is_an_error_not_a_hang() -> None:
    # A negative amplitude of the drag feeds energy in without bound.
    model = udd.Pendulum(0.5, effects=effects.cubic_drag()).with_parameters({"cubic_drag.c": -1.0})
    with pytest.raises(IntegrationError, match="t = "):
        udd.simulate(model, [0, 100], [1.0, 0.0])


def test_a_single_time_is_the_start() -> None:
    run = udd.simulate(udd.DLE(1.0), [3.0], [1, 1, 1])
    assert run.t.tolist() == [3.0] and run.state.tolist() == [[1, 1, 1]] and run.outcome == "finished"


INTERRUPTED = """
import os, signal, sys, threading, time, warnings
import numpy as np, udd, xarray
called = 0.0, 0.0
def fire():
    global called
    called = time.perf_counter(), time.process_time()
    os.kill(os.getpid(), signal.SIGINT)
for _ in range(3):
    threading.Timer(0.3, fire).start()
    try:
        {call}
    except KeyboardInterrupt:
        print(time.perf_counter() - called[0], time.process_time() - called[1])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize(
    "call",
    [
        "udd.simulate(udd.DLE(1.0), [0, 1e9], [1, 1, 0.01])",
        "udd.lyapunov(np.linspace(1, 4, 64), tol=1e-9, t=1e9)",
        "udd.ensemble(udd.DLE(1.0), 1e5, np.ones((10_000, 3)))",
        "udd.poincare(udd.DLE(1.0), n=1_000_000, parameters={'w': np.linspace(1, 5, 64)})",
        "udd.bifurcation(udd.DLE(1.0), 'w', np.linspace(1, 9, 4000))",
        "udd.basins(udd.DLE(6.2), {'omega': np.linspace(-3, 3, 300), 'z': np.linspace(-3, 3, 300)})",
        "udd.sweep(udd.SweepSpec('lyapunov', udd.DLE(1.0), {'w': np.linspace(1, 2, 9999)}))",
    ],
)
def test_ctrl_c_is_answered_within_0_2_s(call: str) -> None:
    code = INTERRUPTED.format(call=call)
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    delays = np.array([line.split() for line in out.stdout.splitlines()], float)
    assert delays.shape == (3, 2), out.stderr
    # CPU time on all threads, not the time spent waiting: a busy machine may delay any run.
    wall, worked = delays.T
    assert worked.min() < 0.2 * os.cpu_count() and wall.min() < 5  # type: ignore[operator]


@pytest.mark.skipif(sys.platform != "linux", reason="a limit of memory for a process of its own")
@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            "udd.simulate(udd.DLE(1.0), 1e9, [1, 1, 0.01], method='taylor')",
            r"keeping every step to t = 1000000000 would need about \d{2,3}\.\d{3} GB, .*give the times",
        ),
        (
            "udd.simulate(udd.DLE(1.0), [0, 1e9], [1, 1, 0.01], dense=True)",
            r"keeping every step to t = 1000000000 would need about \d{3,4}\.\d{3} GB, .*leave out dense",
        ),
        (
            "udd.ensemble(udd.DLE(1.0), np.arange(10_000), np.ones((100_000, 3)))",
            r"100000 runs of 10000 states take 24\.000 GB, for which there is no room",
        ),
        (
            "udd.poincare(udd.DLE(1.0), n=10**9)",
            r"1000000000 points take 33\.000 GB, for which there is no room",
        ),
    ],
    ids=["steps", "polynomials", "runs", "points"],
)
def test_what_does_not_fit_into_memory_is_said(call: str, said: str) -> None:
    message = memory_error_of(call, limit=3 << 29)
    assert re.match(said, message), message


def test_arrays_that_are_not_aligned_are_copied() -> None:
    def askew(values: list[float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        room = np.zeros(8 * len(values) + 1, dtype=np.uint8)
        there = room[1:].view(np.float64)
        there[:] = values
        assert not there.flags.aligned
        return there

    times, start = [0.0, 1.0, 2.0], [1.0, 1.0, 0.01]
    run = udd.simulate(udd.DLE(1.0), askew(times), askew(start), dense=True)
    assert np.array_equal(run.state, udd.simulate(udd.DLE(1.0), times, start).state)
    assert np.array_equal(run(askew(times)), run.state)
    ends = [udd.ensemble(udd.DLE(1.0), t, start).end for t in (askew(times), times)]
    assert np.array_equal(*ends)
    assert np.array_equal(udd.DLE(1.0).rates(0.0, askew(start)), udd.DLE(1.0).rates(0.0, start))
