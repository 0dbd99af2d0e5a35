"""Profiles of all models: a new model gets the same tests without another line."""

from __future__ import annotations

import numpy as np
import pytest

import udd
from udd.models import Model, beyond_the_edge, profile_of
from udd.models.parameter_batch import default_state, outside_domain
from udd.models.registry import COMPILED, MODELS
from udd.models.serialization import model_from_dict, model_to_dict
from udd.models.state_scaling import coordinates_of

# A model's first parameter alone has no default; a drive of this size suits all units that there are.
COMPILED_MODELS = [beyond_the_edge(cls(0.05)) for cls in COMPILED.values()]  # type: ignore[call-arg]


@pytest.fixture(params=COMPILED_MODELS, ids=lambda model: model.kind)
def model(request: pytest.FixtureRequest) -> Model:
    return request.param


def test_the_profile_of_a_kind_is_that_of_its_models(model: Model) -> None:
    assert profile_of(model.kind) is model.profile
    assert model_from_dict(model_to_dict(model)) == model


def test_only_what_a_user_wrote_is_called_written() -> None:
    assert [kind for kind, cls in MODELS.items() if cls.profile.written] == ["own"]


def test_names_of_the_profile_are_names_of_the_model(model: Model) -> None:
    dynamics, sensor, fit, shown = (
        model.profile.dynamics, model.profile.sensor, model.profile.fit, model.profile.shown
    )  # fmt: skip
    parameters, states = set(model.parameters), set(model.state_names)
    assert set(fit.priors or ()) | set(fit.fixed) | set(fit.stated) | set(fit.unknown) <= parameters
    assert {dynamics.drive} - {None} <= parameters and set(shown.meanings) <= parameters
    assert {dynamics.section, dynamics.rotation} - {None} <= states
    assert set(sensor.columns) | set(fit.equations or ()) | set(shown.columns) | set(shown.path) <= states
    assert set(sensor.pivot) <= set(sensor.camera) and {sensor.zero} - {None} <= set(sensor.pivot)


def test_lists_of_the_profile_are_as_long_as_what_they_are_of(model: Model) -> None:
    sensor, fit, dim = model.profile.sensor, model.profile.fit, len(model.state_names)
    assert len(sensor.columns) == len(sensor.units) == len(sensor.sigma) >= sensor.compared
    assert all(len(level) == dim for level in fit.model_error)
    # From loose to tight in every component.
    assert (np.diff(np.array(fit.model_error).reshape(-1, dim), axis=0) < 0).all()
    assert model.profile.discovery.filter_level < len(fit.model_error) or not fit.model_error


def test_an_orbit_runs_from_the_usual_start_and_crosses_the_usual_section(model: Model) -> None:
    start = default_state(model)
    assert len(start) == len(model.state_names)
    assert not outside_domain(model, np.array([list(model.parameters.values())]), np.array([start])).any()
    run = udd.simulate(model, 20.0, start)
    assert run.outcome == "finished"
    coordinates = coordinates_of(model, run.state)
    assert (coordinates.size > 0).all() and coordinates.clock > 0
    assert udd.poincare(model, n=3).found == 3


def test_the_energy_changes_along_a_run_by_the_powers(model: Model) -> None:
    if model.profile.dynamics.energy is None:
        pytest.skip("no energy is known of it")
    step = 1e-3
    run = udd.simulate(model, np.arange(0, 3, step), default_state(model))
    books = udd.energy_balance(run)
    change = (books.stored[2:] - books.stored[:-2]) / (2 * step)
    powers = (books.motor - books.friction + books.effects)[1:-1]
    # Central differences: their error is step^2/6 times a third derivative, which kinks of friction bound.
    # Runs are good to 1e-9 of energies of order one, which over 2 ms is 5e-7 of power.
    np.testing.assert_allclose(change, powers, atol=2e-3 * np.abs(powers).max() + 1e-6)


def test_moments_of_inertia_are_positive(model: Model) -> None:
    if model.profile.dynamics.inertia is None:
        pytest.skip("it has none")
    states = np.random.default_rng(0).normal(size=(50, len(model.state_names)))
    assert (np.asarray(model.profile.dynamics.inertia(model, states)) > 0).all()
