"""Specs, configs, models and effects made wrong in one place or several: each is refused in one sentence."""

from __future__ import annotations

import copy
import json
import random
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import udd
from udd.app.spec import start_of
from udd.cli.inputs import own_model
from udd.cli.inputs import start_of as hidden_start_of
from udd.effects import serialization
from udd.sweeps import SweepSpec
from udd.tracking.calibration.config import settings

NESTED: list[Any] = []
for _ in range(60):
    NESTED = [NESTED]

ODD: list[Any] = [
    *(None, True, False, 0, -1, 1, 2**31, 2**63, 10**400, -(10**400), 0.5, 1e308, float("nan"), float("inf")),
    *("", "x", "name", "kind", "a" * 5000, "(" * 300, "sin(", "1/0", "\0", "ä", "4x4_50:-1", "nowhere:0"),
    *([], [[]], [1], [1, 2], ["x"], [None], [[[[1]]]], {}, {"x": 1}, {"values": []}, NESTED),
    *("b " * 2000, ["b"] * 400, [7] * 400),
    *({"from": 0, "to": 1, "n": n} for n in (-1, 2.5, 2**31, 2**63)),
]

SWEEPS: list[Any] = [
    {
        "quantity": "lyapunov",
        "model": {"kind": "dle", "w": 1.0},
        "over": {"w": {"from": 0.5, "to": 2.0, "n": 4}},
        "options": {"tol": 0.02},
        "chunk": 4,
        "state0": [1, 1, 0.01],
    },
    {
        "quantity": "outcome",
        "model": {
            "kind": "disk",
            "W": 0.039,
            "effects": [
                {"name": "relaxation", "b": 6.0},
                {"name": "coulomb", "c": 0.1, "treatment": "set-valued"},
            ],
        },
        "over": [{"name": "W", "values": [0.03, 0.039]}, {"name": "Z", "from": -0.06, "to": 0.06, "n": 4}],
        "options": {"t": 10.0},
    },
    {
        "quantity": "final_state",
        "model": {
            "kind": "formula",
            "states": ["x", "v"],
            "equations": {"x": "v", "v": "-k*x"},
            "parameters": [["k", 1.0]],
        },
        "over": {"k": [1, 2, 3]},
        "state0": [1, 0],
        "options": {"t": 5.0},
    },
]
CONFIGS: list[Any] = [
    {
        "disk_radius": 0.08,
        "mark_distance": 0.065,
        "fps": 240,
        "pivot": [275, 310.5],
        "refine": True,
        "scale": 1750.0,
        "region": [0, 0, 550, 700],
        "calibrate": {"lens": False, "readout": 0.02},
        "sigma": {"pivot": 1.0},
        "apart": [1, 2, 0.09],
    },
    {"layout": [{"at": [0, 0.065], "colour": "red"}, {"at": [0.065, 0], "colour": "blue"}]},
    {"layout": [{"tag": "4x4_50:7", "at": [0, 0.05], "side": 0.03}]},
    {"bob": "red", "length": 0.5},
]
EFFECTS: list[Any] = [
    serialization.to_dict(udd.effects.formula("torque", "a*sin(2*beta)", name="warp", a=0.01)),
    serialization.to_dict(udd.effects.curve("torque", "Omega", -8, 8, [0.02, 0.01, 0, -0.01, -0.02])),
]
MODELS: list[Any] = [
    {
        "states": ["x", "v"],
        "equations": {"x": "v", "v": "-k*x + exp(-x)"},
        "parameters": {"k": 1.0},
        "angles": ["x"],
        "state0": {"v": 0.1},
    },
    {
        "states": ["q", "v"],
        "equations": {"q": "v", "v": "(torque - c*v)/J"},
        "parameters": {"J": 1.0, "c": 0.1, "gain": 2.0, "late": 0.0},
        "angles": ["q"],
        "mass": [["J"]],
        "inputs": ["torque"],
        "observe": {"volts": "gain*q", "gyro": "v"},
        "delays": {"torque": "late", "gyro": "late"},
    },
]
STARTS: list[Any] = [
    {
        "model": {"kind": "disk", "W": 0.03, "effects": [{"name": "relaxation", "b": 6.0}]},
        "state": [0, 0.001, 0.04, 0],
    }
]


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The way to each part of nested tables and lists."""
    yield at
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], (*at, key))
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from places(item, (*at, k))


def mutated(sample: Any, chance: random.Random) -> Any:
    """The sample with one to three of its parts replaced, removed, renamed, or more of them."""
    value = copy.deepcopy(sample)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        *way, last = chance.choice([at for at in places(value) if at] or [(None,)])
        if last is None or chance.random() < 0.01:
            return copy.deepcopy(chance.choice(ODD))
        parent = value
        for key in way:
            parent = parent[key]
        odd, what = copy.deepcopy(chance.choice(ODD)), chance.random()
        if what < 0.6:
            parent[last] = odd
        elif what < 0.75:
            del parent[last]
        elif isinstance(parent, list):
            parent.insert(last, odd)
        else:
            parent[chance.choice(["w", "x", "name", "kind", "k0", "", "theta", "a b"])] = odd
    return value


def read_spec(value: Any, folder: Path) -> None:
    path = folder / "spec.json"
    path.write_text(json.dumps(value))
    SweepSpec.read(path)


def read_model(value: Any, folder: Path) -> None:
    path = folder / "model.json"
    path.write_text(json.dumps(value))
    args = Namespace(model=path, pendulum=None, W=None)
    own_model(args)
    hidden_start_of(args)


READERS: dict[str, tuple[list[Any], Callable[[Any, Path], object]]] = {
    "sweep": (SWEEPS, read_spec),
    "sweep, as data": (SWEEPS, lambda value, _folder: SweepSpec.from_dict(value)),
    "config": (CONFIGS, lambda value, _folder: settings(value)),
    "effect": (EFFECTS, lambda value, _folder: serialization.from_dict(value)),
    "model": (MODELS, read_model),
    "page": (STARTS, lambda value, _folder: start_of(value)),
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("count", [400, pytest.param(20_000, marks=pytest.mark.nightly)])
def test_what_was_made_wrong_is_refused_in_a_sentence(kind: str, count: int, tmp_path: Path) -> None:
    pytest.importorskip("cv2")  # which knows the tags
    samples, read = READERS[kind]
    for sample in samples:
        read(copy.deepcopy(sample), tmp_path)
    chance = random.Random(kind)
    refused = 0
    for _ in range(count):
        value = mutated(chance.choice(samples), chance)
        try:
            read(value, tmp_path)
        except udd.UddError as error:
            refused += 1
            said = str(error)
            assert len(said) <= 500
            assert "\n" not in said
            assert max(map(len, said.split())) <= 200
            assert not any(given in said for given in ("b " * 101, "'b', " * 41, "7, " * 67))
    assert refused > count // 2


@pytest.mark.parametrize(
    ("kind", "value", "said"),
    [
        (
            "sweep",
            {**SWEEPS[0], "over": {"w": {"from": 0, "to": 1, "n": "3"}}},
            "over.w.n must be a whole",
        ),
        (
            "sweep",
            {**SWEEPS[0], "over": {"w": {"from": "0", "to": 1, "n": 3}}},
            "over.w.from must be",
        ),
        (
            "sweep",
            {**SWEEPS[0], "over": {"w": {"from": 0, "too": 1, "n": 3}}},
            "over.w must be a list",
        ),
        ("sweep", {**SWEEPS[0], "model": NESTED}, "a sweep is nested more than 16 deep"),
        ("sweep", {**SWEEPS[0], "model": 3}, "the model must be a table"),
        ("sweep", {**SWEEPS[0], "model": {"kind": "dle", "W": 1}}, "a dle has no 'W'; it has w"),
        (
            "effect",
            {"curve": {"slot": "torque", "at": 1}},
            "a curve has no 'at'; it has slot, coordinate",
        ),
        ("effect", {"formula": {"slot": "torque"}}, "a formula does not say its expression"),
        ("model", {**MODELS[0], "states": ["x"]}, "there is an equation of 'v', but the states are x"),
        (
            "model",
            {**MODELS[0], "state": ["x"]},
            "your own has no 'state'; it has states, equations",
        ),
        ("config", {"sigma": {"lens": 1}}, "sigma has no 'lens'; it has pivot, scale, layout"),
    ],
)
def test_a_sentence_says_where_and_what_there_is(kind: str, value: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(udd.UddError) as error:
        READERS[kind][1](value, tmp_path)
    assert said in str(error.value)


@pytest.mark.parametrize("text", ["[" * 100_000, "{" * 100_000, '{"a":' * 100_000])
def test_brackets_without_end_are_refused(text: str, tmp_path: Path) -> None:
    spec, config = tmp_path / "spec.toml", tmp_path / "track.toml"
    for path in (spec, config):
        path.write_text(f"over = {text}")
    with pytest.raises(udd.UddError):
        SweepSpec.from_json(text)
    with pytest.raises(udd.UddError, match=r"spec\.toml"):
        SweepSpec.read(spec)
    with pytest.raises(udd.UddError, match=r"track\.toml"):
        settings(config)
