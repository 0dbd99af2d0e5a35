"""Missing terms of users' own models: the same search as on the disk."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import udd
from udd.cli import main
from udd.discovery.acceptance import Acceptance, SearchState
from udd.discovery.discover import TRAIN
from udd.discovery.score_rounds import score_round
from udd.discovery.scoring.candidates import library
from udd.discovery.scoring.term_library import given_terms
from udd.discovery.search import Search, SearchPath
from udd.discovery.time_budget import Clock
from udd.discovery.trial_fits import fitted_ones, of_library
from udd.errors import FitError, ModelError
from udd.fitting import fit_record, record_of
from udd.fitting.time_scale import motion_time_scale
from udd.report import formula_report

DRIVEN = {"theta": "v", "v": "-w2*sin(theta) - g*v + F*cos(1.4*t)"}
DRIVEN_VALUES = {"w2": 4.0, "g": 0.05, "F": 2.0}
#: Two equal masses on rods: a the first angle, b the second relative to it, and their momenta p and q.
DA = "((p - (1 + cos(b))*q)/(2 - cos(b)^2))"
DB = "(((3 + 2*cos(b))*q - (1 + cos(b))*p)/(2 - cos(b)^2))"
DOUBLE = {
    "a": DA,
    "b": DB,
    "p": "-2*g*sin(a) - g*sin(a + b)",
    "q": f"-g*sin(a + b) - sin(b)*{DA}*({DA} + {DB})",
}


def seen(
    model: Any, t: np.ndarray, start: list[float], noise: float, columns: str | list[str], seed: int = 0
) -> udd.Measurement:
    """A measured run: noise as a share of each column's spread."""
    run = udd.simulate(model, t, start).state
    rng = np.random.default_rng(seed)
    names = list(model.state_names)
    values = {}
    for name in columns:
        x = run[:, names.index(name)]
        values[name] = x + noise * x.std() * rng.standard_normal(len(t))
    return udd.Measurement(t, values)


def within(answer: udd.Discovery, name: str, truth: float) -> None:
    """The value lies within four standard errors, which are below a tenth of it."""
    value, error = answer.fit.parameters[name], answer.fit.errors[name]
    assert abs(value - truth) < 4 * error < 0.4 * abs(truth)


def test_the_candidates_are_made_of_the_states() -> None:
    driven = udd.Model(["theta", "v"], DRIVEN, DRIVEN_VALUES, angles=["theta"])
    titles = [c.title for c in library(driven)]
    assert {"1 in v'", "v^3 in v'", "abs(v)*v in v'", "sin(2*theta) in v'", "v*cos(theta) in v'"} <= set(
        titles
    )
    # theta' = v says what v is, and theta has no powers.
    assert all(title.endswith("in v'") and "theta^2" not in title for title in titles)
    double = udd.Model(list("abpq"), DOUBLE, {"g": 9.81}, angles=["a", "b"])
    assert {"b' in q'", "a' in p'", "sin(a - b) in p'"} <= {c.title for c in library(double)}
    lorenz = udd.Model(list("xyz"), {"x": "y - x", "y": "-x*z", "z": "x*y"})
    expected = [d for k in range(4) for d in itertools.combinations_with_replacement("xyz", k)]
    assert len(library(lorenz)) == 3 * (len(expected) + 3)
    # Each is added with an amplitude of zero, whatever names the model has taken.
    for model in (driven, double, udd.Model(["c", "a"], ["-b*c", "c - a"], {"b": 1.0})):
        state = np.full(len(model.state_names), 0.3)
        for candidate in library(model):
            assert (candidate.added_to(model).rates(0.0, state) == model.rates(0.0, state)).all()


def test_the_damping_of_the_diffusionless_lorenz_system_is_found_in_noise() -> None:
    equations = {"omega": "y - omega", "y": "omega*z", "z": "-omega*y + w"}
    baseline = udd.Model(list(equations), equations, {"w": 1.0})
    truth = baseline.with_term("z", "z", damping=-0.2)
    record = seen(truth, np.arange(0, 40, 0.05), [1.0, 1.0, 0.5], 0.05, list(equations))
    result = udd.discover(record, baseline)
    assert result.verdict == "effect identified" and [e.title for e in result.effects] == ["z in z'"]
    within(result, "z_in_z.c", -0.2)
    assert result.effects[0].ratio[2] < 0.2
    # The errors fall to what noise alone leaves, here to within the scatter of a few dozen starts.
    assert (result.error_after.median[:3] < 2 * result.error_after.floor[:3]).all()
    assert result.model.with_effects([]) == result.model.replace(effects=[])
    assert result.to_dict()["effects"][0]["parameters"]["c"]["se"] > 0


@pytest.mark.parametrize(
    ("lacking", "title", "values"),
    [
        ("- 0.08*abs(v)*v", "abs(v)*v in v'", {"abs_v_v_in_v.c": -0.08}),
        ("+ 0.1*sin(4.2*t)", "a wave", {"wave_in_v.b": 0.1, "wave_in_v.f": 4.2 / (2 * np.pi)}),
        ("", None, {}),
    ],
)
def test_what_a_driven_pendulum_lacks_is_found_from_its_angle_alone(
    lacking: str, title: str | None, values: dict[str, float]
) -> None:
    truth = udd.Model(["theta", "v"], DRIVEN | {"v": DRIVEN["v"] + lacking}, DRIVEN_VALUES)
    baseline = udd.Model(["theta", "v"], DRIVEN, {"w2": 3.8, "g": 0.1, "F": 1.8}, angles=["theta"])
    record = seen(truth, np.arange(0, 60, 0.06), [0.5, 0.0], 0.002, ["theta"])
    result = udd.discover(record, baseline)
    if title is None:
        assert result.verdict == "nothing missing" and not result.effects
        return
    assert result.verdict == "effect identified"
    assert len(result.effects) == 1 and result.effects[0].title.startswith(title)
    for name, value in values.items():
        within(result, name, value)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.nightly)])  # 0 asks the same as 1
def test_what_a_later_effect_makes_needless_is_left_out_together(seed: int) -> None:
    # At first two other terms together imitate the missing one; with it neither is needed.
    baseline = udd.Model(["x", "y"], ["1 - a*x + b*x^2*y", "k*x"], {"a": 3.6, "b": 3.4, "k": 3.3})
    truth = baseline.replace(a=4.03, b=3.1, k=3.03).with_term("y", "x^2*y", loss=-3.1)
    t = np.linspace(0, 10, 512)
    states = udd.simulate(truth, t, [0.7, -1.4]).state
    noisy = states * (1 + 0.05 * np.random.default_rng(seed).standard_normal(states.shape))
    result = udd.discover(udd.Measurement(t, dict(zip("xy", noisy.T, strict=True))), baseline)
    assert result.verdict == "effect identified" and [e.title for e in result.effects] == ["x^2*y in y'"]
    within(result, "x2_y_in_y.c", -3.1)


def test_a_model_that_cannot_follow_the_record_lacks_something() -> None:
    # Without its growth the oscillator comes to rest; no candidate fits while y is not seen.
    values = {"a": 3.37, "b": -3.37 / 3, "c": -1 / 3.37}
    baseline = udd.Model(["x", "y"], ["a*y + b*x^3", "c*x"], {"a": 3.05, "b": -0.91, "c": -0.32})
    t = np.linspace(0, 10, 256)
    states = udd.simulate(baseline.replace(**values).with_term("x", "x", g=3.37), t, [0.7, 0.0]).state
    result = udd.discover(udd.Measurement(t, {"x": states[:, 0]}), baseline, state0={"y": 0.0})
    assert result.fit.doubts.missing or result.effects
    assert result.verdict != "nothing missing"


#: Two bodies on a double pendulum's angles, the force of which goes through their mass matrix.
COUPLED = [["2", "0.6*cos(x - y)"], ["0.6*cos(x - y)", "1"]]
_F, _H = "(-k*sin(x) - 0.6*sin(x - y)*w^2)", "(-0.5*k*sin(y) + 0.6*sin(x - y)*v^2)"
_DET = "(2 - 0.36*cos(x - y)^2)"
MECHANISM = {
    "x": "v",
    "y": "w",
    "v": f"({_F} - 0.6*cos(x - y)*{_H})/{_DET}",
    "w": f"(2*{_H} - 0.6*cos(x - y)*{_F})/{_DET}",
}


def mechanism(*forces: udd.effects.Effect) -> Any:
    baseline = udd.Model(list("xyvw"), MECHANISM, {"k": 10.0}, angles=["x", "y"], mass=COUPLED)
    return baseline.with_effects(forces)


def test_friction_in_both_joints_is_found_by_joint(tmp_path: Path) -> None:
    """One coefficient each, which enters both equations."""
    truth = mechanism(
        udd.effects.formula("force(x)", "-c*v", name="first", c=0.04),
        udd.effects.formula("force(y - x)", "-c*(w - v)", name="second", c=0.05),
    )
    t = np.arange(0, 12, 0.06)
    run = udd.simulate(truth, t, [1.2, -0.5, 0.0, 0.0]).state
    noise = 3e-3 * np.random.default_rng(0).standard_normal((len(t), 2))
    record = udd.Measurement(t, run[:, :2] + noise, names=("x", "y"))
    result = udd.discover(record, mechanism().replace(k=9.9))
    assert result.verdict == "effect identified"
    assert {e.title for e in result.effects} == {
        "viscous friction along x",
        "viscous friction between x and y",
    }
    within(result, "viscous_friction_along_x.c", 0.04)
    within(result, "viscous_friction_between_x_and_y.c", 0.05)
    result.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "a force that enters every acceleration through the mass matrix" in page.lower()


def test_forces_of_machines_come_before_products() -> None:
    motion = np.random.default_rng(0).normal(size=(50, 4))
    listed = library(mechanism(), (), motion)
    usual = {c.title for c in listed if c.usual}
    assert {"viscous friction along x", "quadratic drag between x and y", "dry friction along y"} <= usual
    assert {c.effect.slots[0] for c in listed} == {"force(x)", "force(y)", "force(y - x)"}
    # No force has two names: v in force(x) is the viscous friction along x.
    assert not {"v in force(x)", "abs(w)*w in force(y)", "1 in force(x)"} & {c.title for c in listed}
    assert "w in force(x)" in {c.title for c in listed} - usual
    (given,) = given_terms(mechanism(), [("force(y - x)", "v*w")])
    assert given.title == "v*w in force(y - x)" and given.effect.slots == ("force(y - x)",)
    with pytest.raises(ModelError, match="acts along one of x, y"):
        given_terms(mechanism(), [("force(v)", "w")])
    cart = udd.Model(["x", "v"], ["v", "-k*x"], {"k": 1.0}, mass=[["1"]])
    assert {"spring along x", "cubic spring along x"} <= {c.title for c in library(cart)}


def test_an_effect_that_a_later_one_makes_needless_is_left_out() -> None:
    equations = {"x": "v", "v": "-k*x"}
    baseline = udd.Model(["x", "v"], equations, {"k": 1.0})
    record = seen(baseline.with_term("v", "v", c=-0.1), np.arange(0, 30, 0.05), [1.5, 0.0], 0.01, ["x"])
    frames = record_of(record, baseline)
    train = frames.first(TRAIN)
    part, whole = (fit_record(record, some, baseline, search=True) for some in (frames.part(train), frames))
    search = Search(Acceptance(frames, ~train, Clock(None, lambda _text: None), motion_time_scale(part)))
    path = SearchPath([SearchState(part, whole, search.tests.errors(part))])
    for title in ("v^3 in v'", "v in v'"):
        path.rounds.append(score_round(path.states[-1].part))
        (wanted,) = (s for s in path.rounds[-1].library.scored if s.candidate.title == title)
        trial = of_library(path.states[-1].part, [wanted.candidate], list(wanted.amplitudes))
        step = search.tests.best(path.states[-1], fitted_ones([trial]), path.rounds[-1])
        assert step
        path.steps.append(step[0])
        path.states.append(step[1])
    search._leave_out(path)
    assert [[c.title for c in step.candidates] for step in path.steps] == [["v in v'"]]
    assert len(path.states) == 2 and len(path.rounds) == 1


@pytest.mark.nightly  # test_friction_in_both_joints_is_found_by_joint asks the same of forces
def test_damping_at_the_joint_of_a_double_pendulum_is_found_from_its_angles() -> None:
    baseline = udd.Model(list("abpq"), DOUBLE, {"g": 9.7}, angles=["a", "b"])
    truth = baseline.with_parameters({"g": 9.81}).with_term("q", DB, c=-0.05)
    result = udd.discover(seen(truth, np.arange(0, 12, 0.03), [1.5, 0.8, 0.0, 0.0], 0.01, "ab"), baseline)
    assert [e.title for e in result.effects] == ["b' in q'"]
    within(result, "rate_of_b_in_q.c", -0.05)
    within(result, "g", 9.81)


def test_a_users_candidate_is_tried_and_a_wrong_one_named(tmp_path: Path) -> None:
    equations = {"x": "v", "v": "-k*x"}
    baseline = udd.Model(["x", "v"], equations, {"k": 1.0})
    truth = baseline.with_term("v", "tanh(5*v)", friction=-0.05)
    record = seen(truth, np.arange(0, 40, 0.05), [1.5, 0.0], 0.01, ["x", "v"])
    result = udd.discover(record, baseline, candidates=[("v", "tanh(5*v)")])
    assert [e.title for e in result.effects] == ["tanh(5*v) in v'"]
    within(result, "tanh_5_v_in_v.c", -0.05)
    result.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "The rate v&#39; has one more term." in page and "c*(tanh(5*v))" in page
    assert page.count("<img") == 6 and "data:image/svg+xml" in page  # no picture comes from elsewhere
    # The known model's error is that of `udd.fit`: it contains what the model lacks.
    stiffness, friction = formula_report.parameters(result)
    value, _, brackets = str(stiffness["before"]).rstrip(")").partition("(")
    error = float(brackets) / (1 if "." in brackets else 10 ** len(value.partition(".")[2]))
    assert error == pytest.approx(udd.fit(record, baseline).errors["k"], rel=0.5)
    assert error > 5 * result.baseline.errors["k"] and friction["name"] == "c of tanh(5*v) in v'"
    for wrong, said in [
        (("w", "v"), "no equation of 'w'"),
        (("v", "u"), "unknown name u"),
        ("v", "a state and a term"),
    ]:
        with pytest.raises(ModelError, match=said):
            udd.discover(record, baseline, candidates=[wrong])  # type: ignore[list-item]
    t = np.arange(0, 30, 0.05)
    swing = udd.Measurement(t, {"theta": 0.1 * np.cos(3 * t)})
    with pytest.raises(FitError, match="for a model of your own"):
        udd.discover(swing, udd.Pendulum(1.0), candidates=[("v", "v")])


def test_the_command_takes_a_users_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    equations = {"x": "v", "v": "-k*x"}
    truth = udd.Model(["x", "v"], equations, {"k": 1.0}).with_term("v", "v", damping=-0.1)
    record = seen(truth, np.arange(0, 30, 0.05), [1.5, 0.0], 0.01, ["x"])
    table = np.column_stack([record.t, record.values])
    np.savetxt(tmp_path / "swing.csv", table, delimiter=",", header="t,x", comments="")
    swing = tmp_path / "swing.json"
    swing.write_text(json.dumps({"states": ["x", "v"], "equations": equations, "parameters": {"k": 0.9}}))
    assert main(["discover", str(tmp_path / "swing.csv"), "--model", str(swing), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] == "effect identified" and said["effects"][0]["title"] == "v in v'"
    swing.write_text("x' = v")
    assert main(["discover", str(tmp_path / "swing.csv"), "--model", str(swing)]) == 1
    assert "is not JSON" in capsys.readouterr().err


def test_lorenz63_is_recovered_from_thirty_percent_noise() -> None:
    terms = ["1", "x", "y", "z", "x^2", "x*y", "x*z", "y^2", "y*z", "z^2"]
    names = [[f"{s}{k}" for k in range(10)] for s in "xyz"]
    rates = [" + ".join(f"{c}*{term}" for c, term in zip(each, terms, strict=True)) for each in names]
    full = udd.Model(list("xyz"), rates, {name: 0.0 for part in names for name in part})
    truth = {"x1": -10.0, "x2": 10.0, "y1": 28.0, "y2": -1.0, "y6": -1.0, "z3": -8 / 3, "z5": 1.0}
    run = udd.simulate(full.with_parameters(truth), np.arange(0, 10, 0.01), [-8.0, 8.0, 27.0])
    noise = 0.3 * run.state.std() * np.random.default_rng(1001).standard_normal(run.state.shape)
    record = udd.Measurement(run.t, dict(zip("xyz", (run.state + noise).T, strict=True)))
    result = udd.prune(record, full, spread=100.0)
    assert result.kept == list(truth) and len(result.removed) == 23
    for name, value in truth.items():
        assert abs(result.fit.parameters[name] - value) < 4 * result.fit.errors[name]
    assert min(result.rise.values()) > result.price
    with pytest.raises(FitError, match="'w' is not a free parameter"):
        udd.prune(record, full, among=["w"])
    with pytest.raises(FitError, match="spread must be above 0"):
        udd.prune(record, full, spread=0.0)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_terms_that_an_orbit_does_not_determine_go_first(noise: float) -> None:
    powers = ["1", "x", "v", "x^2", "x*v", "v^2", "x^3", "x^2*v", "x*v^2", "v^3"]
    text = " + ".join(f"k{k}*{power}" for k, power in enumerate(powers))
    full = udd.Model(["x", "v"], ["a*v", text], {"a": 1.0} | {f"k{k}": 0.0 for k in range(len(powers))})
    t = np.linspace(0, 10, 512)
    pace = np.sqrt(2.1)
    states = np.column_stack([np.cos(pace * t), -pace * np.sin(pace * t)])
    scatter = np.random.default_rng(3).standard_normal(states.shape)
    record = udd.Measurement(t, dict(zip("xv", (states + noise * scatter).T, strict=True)))
    result = udd.prune(record, full)
    assert result.kept == ["a", "k1"]
    if noise:
        return
    # v^2 + 2.1 x^2 is constant: three terms are combinations of the others.
    assert result.undetermined == ["k5", "k8", "k9"] and set(result.undetermined) < set(result.removed)
    assert result.fit.parameters["k1"] == pytest.approx(-2.1, rel=1e-8)
    with pytest.raises(FitError, match="can change together"):
        udd.prune(record, full, among=["k0", "k1"])


def test_noise_that_grows_with_what_is_seen_is_weighed_by_it() -> None:
    # Predator and prey: one is hundreds of times rarer at times, and then known as many times better.
    truth = {"a": 1.84, "b": -1.45, "c": -3.0, "d": 1.62}
    t = np.linspace(0, 10, 512)
    baseline = udd.Model(["x", "y"], ["a*x + b*x*y", "c*y + d*x*y"], truth)
    states = udd.simulate(baseline, t, [8.3, 3.4]).state
    noisy = states * (1 + 0.01 * np.random.default_rng(1).standard_normal(states.shape))
    record = udd.Measurement(t, dict(zip("xy", noisy.T, strict=True)))
    powers = ["1", "x", "y", "x^2", "x*y", "y^2"]
    names = [[f"k{each}{k}" for k in range(len(powers))] for each in "xy"]
    texts = [" + ".join(f"{n}*{p}" for n, p in zip(part, powers, strict=True)) for part in names]
    full = udd.Model(["x", "y"], texts, {n: 0.0 for own_value in names for n in own_value})
    result = udd.prune(record, full)
    assert result.kept == ["kx1", "kx4", "ky2", "ky4"]
    for name, value in zip(result.kept, truth.values(), strict=True):
        assert abs(result.fit.parameters[name] - value) < 4 * result.fit.errors[name]
    assert result.fit.scatter == pytest.approx(1.0, abs=0.2)


def test_computed_motion_has_no_noise_and_keeps_its_terms() -> None:
    # Every fit of it is exact to the last digits, and the noise that it shows is zero.
    t = np.linspace(0, 10, 512)
    full = udd.Model(["x"], ["a + b*x + c*x^2 + d*x^3"], dict.fromkeys("abcd", 0.0))
    result = udd.prune(udd.Measurement(t, {"x": logistic(t)}), full)
    assert result.kept == ["b", "c"] and not result.undetermined
    assert result.fit.parameters["b"] == pytest.approx(0.8, rel=1e-9)
    assert result.fit.parameters["c"] == pytest.approx(-0.01, rel=1e-9)


def test_effects_belong_to_own_models_as_terms_do() -> None:
    swing = udd.Model(["x", "v"], ["v", "-k*x"], {"k": 1.0})
    drag = udd.effects.formula("v'", "c*abs(v)*v*k", name="drag", c=-0.1)
    model = swing.with_effects([drag])
    assert model.parameters == {"k": 1.0, "drag.c": -0.1}
    assert model.rates(0.0, [1.0, 2.0]) == pytest.approx([2.0, -1.4])
    assert model.replace(**{"drag.c": 0.0}).rates(0.0, [1.0, 2.0]) == pytest.approx([2.0, -1.0])
    assert eval(repr(model), {"Model": udd.Model, "formula": udd.effects.formula}) == model
    bend = udd.effects.curve("v'", "x", -1.0, 1.0, [1.0, 1.0, 1.0, 1.0])
    assert swing.with_effects([bend]).rates(0.0, [0.5, 0.0]) == pytest.approx([0.0, 0.5])
    with pytest.raises(ModelError, match="w', but the model's rates are x', v'"):
        swing.with_effects([udd.effects.formula("w'", "c*x", c=0.0)])
    with pytest.raises(ModelError, match="which is the name of a state"):
        swing.with_effects([udd.effects.formula("v'", "x*v", v=0.0)])
    with pytest.raises(ModelError, match="takes a term"):
        swing.with_effects([udd.effects.slip(c=1.0)])


def logistic(t: np.ndarray) -> np.ndarray:
    """x' = 0.8 x - 0.01 x^2 from 8, in closed form."""
    return 80 / (1 + 9 * np.exp(-0.8 * t))


def test_a_known_model_whose_free_runs_blow_up_is_found_to_lack_its_growth(tmp_path: Path) -> None:
    t = np.linspace(0, 10, 512)
    x = logistic(t) + 0.3 * np.random.default_rng(0).standard_normal(len(t))
    # With x' = k x^2 and k > 0, as the growth at first suggests, a run from 75 diverges within the record.
    result = udd.discover(udd.Measurement(t, {"x": x}), udd.Model(["x"], ["k*x^2"], {"k": 0.001}))
    assert result.verdict == "effect identified"
    assert [f.title for f in result.effects] == ["x in x'"]
    within(result, "x_in_x.c", 0.8)
    within(result, "k", -0.01)
    assert result.report(tmp_path / "page.html")


@pytest.mark.parametrize("record", [logistic, lambda t: 2.0 - 1.5 * np.exp(-0.4 * t)])
def test_what_a_record_without_noise_lacks_is_identified(record: Any) -> None:
    t = np.linspace(0, 10, 512)
    baseline = "k*x^2" if record is logistic else "k"
    result = udd.discover(udd.Measurement(t, {"x": record(t)}), udd.Model(["x"], [baseline], {"k": 0.001}))
    # Free runs are off by what integration leaves, and what that leaves is no noise.
    assert (result.verdict, [f.title for f in result.effects]) == ("effect identified", ["x in x'"])
    expected = 0.8 if record is logistic else -0.4
    assert result.fit.parameters["x_in_x.c"] == pytest.approx(expected, rel=1e-8)


def test_a_short_record_whose_held_out_part_holds_few_stretches_confirms_what_it_shows() -> None:
    t = np.linspace(0, 10, 512)
    turning = np.exp((-0.2 + 2.1j) * t)  # x'' + 0.4 x' + (0.04 + 2.1^2) x = 0 in closed form
    x, v = 0.12 * turning.real, 0.12 * ((-0.2 + 2.1j) * turning).real
    rng = np.random.default_rng(0)
    noisy = {name: s + 0.01 * s.std() * rng.standard_normal(len(t)) for name, s in (("x", x), ("v", v))}
    result = udd.discover(udd.Measurement(t, noisy), udd.Model(["x", "v"], ["v", "-k*x"], {"k": 4.0}))
    # Free runs start in two stretches of the held-out part only, which say nothing about their spread.
    assert (result.verdict, [f.title for f in result.effects]) == ("effect identified", ["v in v'"])
    within(result, "v_in_v.c", -0.4)
    within(result, "k", 0.04 + 2.1**2)
    assert result.ratio[2] < 1.0
