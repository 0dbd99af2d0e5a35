"""Models and effects: what they compute, and what they refuse."""

from __future__ import annotations

import inspect
import math
import pickle

import numpy as np
import pytest

import udd
from udd import effects
from udd.errors import ModelError, UddError

MODELS = [
    udd.DLE(1.0, 0.2),
    udd.Disk(0.039),
    udd.Disk(0.039, effects=[effects.relaxation(b=5.0), effects.coulomb(c=1e-3)], edge="ignore"),
    udd.Pendulum(0.5, k0=0.01, effects=[effects.quadratic_drag(c=1e-3)]),
]


def test_rates_of_the_dle_are_the_equations() -> None:
    x = np.random.default_rng(1).normal(size=(50, 3))
    omega, y, z = x.T
    wanted = np.stack([y - omega, omega * z, 1.7 - omega * y - 0.2 * 1.7 * z], axis=-1)
    # A few roundings of numbers of order ten.
    np.testing.assert_allclose(udd.DLE(1.7, 0.2).rates(0.0, x), wanted, atol=1e-14)


def test_rates_of_the_disk_are_the_equations() -> None:
    x = np.random.default_rng(2).normal(size=(50, 4)) * [5.0, 0.03, 0.03, 3.0]
    omega, y, z, _ = x.T
    k = np.maximum(0.103 - 0.055 * np.abs(omega), 0.012)
    inertia = 0.08**2 / 2 + y**2 + z**2
    wanted = [(9.81 * y - k * omega - z * 0.05 * omega) / inertia, z * omega, 0.05 - y * omega, omega]
    np.testing.assert_allclose(
        udd.Disk(0.05).rates(0.0, x), np.stack(wanted, axis=-1), rtol=1e-12, atol=1e-13
    )


def test_rates_of_the_pendulum_are_the_equations() -> None:
    x = np.random.default_rng(3).normal(size=(50, 2))
    model = udd.Pendulum(0.5, inertia=0.3, k0=0.02, effects=effects.quadratic_drag(c=0.1))
    torque = -9.81 * 0.5 * np.sin(x[:, 1]) - 0.02 * x[:, 0] - 0.1 * np.abs(x[:, 0]) * x[:, 0]
    wanted = np.stack([torque / 0.3, x[:, 0]], axis=-1)
    np.testing.assert_allclose(model.rates(0.0, x), wanted, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_rates_broadcast_over_leading_axes(model: udd.Disk) -> None:
    dim = len(model.state_names)
    states = 0.01 * np.random.default_rng(4).normal(size=(3, 5, dim))
    times = np.linspace(0, 1, 5)
    table = model.rates(times, states)
    assert table.shape == (3, 5, dim)
    for i in range(3):
        for j in range(5):
            np.testing.assert_array_equal(table[i, j], model.rates(times[j], states[i, j]))
    assert model.rates(times, states[0, 0]).shape == (5, dim)
    assert model.rates(0.0, np.empty((0, dim))).shape == (0, dim)
    np.testing.assert_array_equal(model.rates(times, np.asfortranarray(states)), table)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_models_are_values(model: udd.Disk) -> None:
    assert model == model.replace() and hash(model) == hash(model.replace())
    assert pickle.loads(pickle.dumps(model)) == model
    assert (
        eval(
            repr(model), {**vars(effects), **{n: getattr(effects, n) for n in dir(effects)}, **vars_of_udd()}
        )
        == model
    )
    name = next(iter(model.parameters))
    with pytest.raises(AttributeError):
        setattr(model, name, 1.0)
    changed = model.with_parameters({name: 0.7})
    assert changed.parameters == {**model.parameters, name: 0.7}
    assert changed != model and changed.effects == model.effects
    assert list(model.units) == list(model.parameters)


def vars_of_udd() -> dict[str, object]:
    return {name: getattr(udd, name) for name in ("DLE", "Disk", "Pendulum")}


def test_parameters_of_effects_have_dotted_names() -> None:
    model = udd.Disk(0.039, effects=[effects.relaxation(b=5.0), effects.stribeck(c=1e-3)])
    assert list(model.parameters)[6:] == ["relaxation.b", "stribeck.c", "stribeck.fade", "stribeck.eps"]
    assert model.replace(W=0.05, **{"relaxation.b": 7.0}).parameters["relaxation.b"] == 7.0
    assert model.with_parameters({"relaxation.b": 7.0}).effects[0] == effects.relaxation(b=7.0)
    assert model.units["relaxation.b"] == "1/m"
    assert model.with_effects(()).effects == ()


def test_a_fit_may_leave_the_physical_range() -> None:
    model = udd.Disk(0.039, effects=[effects.quadratic_drag(c=1e-3)])
    changed = model.with_parameters({"quadratic_drag.c": -1e-3, "k0": -0.01})
    assert changed.effects[0].values == (-1e-3,) and changed.k0 == -0.01
    for bad in ({"R": 0.0}, {"k0": math.nan}, {"quadratic_drag.c": math.inf}, {"k9": 1.0}):
        with pytest.raises(ModelError, match=next(iter(bad)).split(".")[-1]):
            model.with_parameters(bad)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: udd.Disk(-0.01), "W must not be below 0"),
        (lambda: udd.Disk(math.nan), "W must be finite"),
        (lambda: udd.Disk(math.inf), "W must be finite"),
        (lambda: udd.Disk(10**400), "W is too large a number"),
        (lambda: udd.Disk("fast"), "W must be a number"),
        (lambda: udd.Disk(None), "W must be a number"),
        (lambda: udd.Disk([0.1, 0.2]), "W must be a number"),
        (lambda: udd.Disk(0.039, R=0.0), "R must be above 0"),
        (lambda: udd.Disk(0.039, R=-0.08), "R must be above 0"),
        (lambda: udd.Disk(0.039, R=math.nan), "R must be finite"),
        (lambda: udd.Disk(0.039, k1=-0.1), "k1 must not be below 0"),
        (lambda: udd.Disk(0.039, g=math.inf), "g must be finite"),
        (lambda: udd.Disk(0.039, edge="bounce"), "edge must be"),
        (lambda: udd.Disk(0.039, effects=["relaxation"]), "effects must be made by udd.effects"),
        (lambda: udd.Disk(0.039, effects=3), "effects must be a list of effects"),
        (lambda: udd.Disk(0.039, effects=[effects.slip(), effects.slip(c=1.0)]), "slip is given twice"),
        (lambda: udd.DLE(-1.0), "w must not be below 0"),
        (lambda: udd.DLE(1.0, math.nan), "B must be finite"),
        (lambda: udd.DLE(1.0).with_effects([effects.slip()]), "no effects"),
        (lambda: udd.DLE(1.0).replace(W=2.0), "no 'W'"),
        (lambda: udd.Pendulum(0.0), "length must be above 0"),
        (lambda: udd.Pendulum(0.5, inertia=-1.0), "inertia must be above 0"),
        (lambda: udd.Pendulum(0.5, effects=[effects.slip()]), "slip acts on a disk, not on a pendulum"),
        (lambda: effects.relaxation(b=math.nan), "b of relaxation must be finite"),
        (lambda: effects.relaxation(c=1.0), "no parameter 'c'"),
        (lambda: effects.relaxation(momentum="none"), "momentum of relaxation must be"),
        (lambda: effects.coulomb(momentum="consistent"), "momentum of coulomb must be"),
        (lambda: effects.coulomb(c=-1.0), "between 0 and inf"),
        (lambda: effects.coulomb(eps=0.0), "eps of coulomb must be between"),
        (lambda: effects.Effect("gremlins", (1.0,)), "no effect is called 'gremlins'"),
        (lambda: effects.Effect("slip", (1.0, 2.0)), "takes 1 numbers"),
        (lambda: udd.DLE(1.0).rates(0.0, [1.0, 2.0]), "3 components"),
        (lambda: udd.DLE(1.0).rates(0.0, [1.0, 2.0, math.nan]), "state must be finite"),
        (lambda: udd.DLE(1.0).rates([0.0, 1.0], np.ones((3, 3))), "do not fit together"),
        (lambda: udd.DLE(1.0).rates("now", np.ones(3)), "t must be numbers"),
    ],
)
def test_bad_input_gets_one_clear_sentence(make, named) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(UddError) as caught:
        make()
    message = str(caught.value)
    assert named in message and "\n" not in message and len(message) < 400


@pytest.mark.parametrize("spec", effects.library(), ids=lambda s: s.name)
def test_every_effect_has_a_constructor(spec: effects.Spec) -> None:
    make = getattr(effects, spec.name)
    effect = make()
    assert effect == spec.make() and effect.spec is spec
    assert list(inspect.signature(make).parameters)[: len(spec.parameters)] == [
        p.name for p in spec.parameters
    ]
    assert spec.equation in make.__doc__ and all(p.name in make.__doc__ for p in spec.parameters)
    assert effect.amplitudes and set(effect.amplitudes) <= set(effect.parameters)
    assert pickle.loads(pickle.dumps(effect)) == effect
    for momentum in spec.momenta:
        assert make(momentum=momentum).momentum == momentum
    # The formula with its numbers put in names no parameter of the effect any more.
    numbers = {p.name: (0.25 if p.role == "amplitude" else p.default) for p in spec.parameters}
    expression = spec.make(**numbers).expression
    assert expression != spec.equation and "0.25" in expression
    velocity = bool({"lateral", "vertical"} & set(spec.slots))
    assert bool(spec.momenta) == velocity
    bodies = {"disk": (udd.Disk(0.039), [2.0, 0.01, -0.02, 0.3]), "pendulum": (udd.Pendulum(0.5), [2.0, 0.3])}
    for body in spec.bodies:
        plain, x = bodies[body]
        # Zero amplitude: the plain equations, up to the order of a few sums.
        np.testing.assert_allclose(
            plain.with_effects([effect]).rates(1.0, x), plain.rates(1.0, x), rtol=1e-12
        )


def test_unknown_effects_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="gremlins"):
        effects.gremlins  # noqa: B018
    assert "relaxation" in dir(effects)


def test_public_names_are_there_and_the_same_for_type_checkers() -> None:
    import ast
    from pathlib import Path

    source = Path(inspect.getfile(udd)).with_suffix(".pyi").read_text(encoding="utf-8")
    checked = {
        (alias.name, node.module)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    }
    assert {name for name, _ in checked} == set(udd.__all__)
    for name in udd.__all__:
        assert getattr(udd, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        udd.nonsense  # noqa: B018


def test_importing_udd_is_fast() -> None:
    import subprocess
    import sys

    code = (
        "import sys, udd; udd.Disk; heavy = {'cv2', 'av', 'matplotlib', 'pandas', 'scipy', 'xarray'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert out.stdout.strip() == "[]"


def test_a_disk_from_its_wheel_has_the_speed_of_the_rim() -> None:
    disk = udd.Disk.from_wheel(2.0, wheel=0.025, k0=0.02, edge="ignore")
    assert disk == udd.Disk(0.05, k0=0.02, edge="ignore")
    for bad in ({"rate": -1.0}, {"rate": 1.0, "wheel": 0.0}, {"rate": math.nan}):
        with pytest.raises(ModelError):
            udd.Disk.from_wheel(**bad)


def test_friction_under_load_takes_the_load_from_how_the_centre_accelerates() -> None:
    plain = udd.Disk(0.071)
    loaded = udd.Disk(0.071, effects=[udd.effects.load_friction(a=0.4)])
    states = np.random.default_rng(3).uniform([-9, -0.04, -0.04, 0], [9, 0.04, 0.04, 6], (50, 4))
    rates = plain.rates(0.0, states)
    # d^2Z/dT^2 along the plain motion, by differences of dZ/dT.
    h = 1e-6
    later, earlier = (plain.rates(0.0, states + step * rates)[:, 2] for step in (h, -h))
    load = 1.0 + (later - earlier) / (2 * h) / plain.parameters["g"]
    omega, y, z, _ = states.T
    k = np.maximum(0.103 - 0.055 * np.abs(omega), 0.012)
    inertia = 0.08**2 / 2 + y**2 + z**2
    added = -0.4 * (load - 1.0) * k * omega / inertia
    # The error of differences, for rates up to some hundred.
    np.testing.assert_allclose(loaded.rates(0.0, states)[:, 0] - rates[:, 0], added, rtol=1e-6, atol=1e-5)
    np.testing.assert_array_equal(loaded.rates(0.0, states)[:, 1:], rates[:, 1:])
