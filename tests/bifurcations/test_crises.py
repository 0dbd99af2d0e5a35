"""Crises of chaotic attractors, against lifetimes and long runs on both sides."""

from __future__ import annotations

import json

import numpy as np
import pytest

import udd
from udd.errors import ModelError


def window() -> udd.Branch:
    """The cycles of the small attractors below w = 6.03, stable and unstable."""
    orbit = udd.periodic_orbit(udd.DLE(6.0), [0.72665, -8.82437, 0.0])
    return udd.continuation(orbit, "w", (5.9, 6.1))


@pytest.fixture(scope="module")
def boundary() -> udd.Crisis:
    (one,) = udd.crises(window(), n=15, depth=15)  # the nightly test follows more orbits for longer
    return one


def test_small_attractor_ends_at_a_boundary_crisis(boundary: udd.Crisis) -> None:
    assert boundary.kind == "boundary crisis" and boundary.side == "above"
    # It collides with the cycle that was born with it, at the fold of its window.
    assert not boundary.cycle.stable and boundary.cycle.period == pytest.approx(5.9994256, abs=1e-6)
    assert boundary.cycle.model.parameters["w"] == boundary.value
    assert 0.0 < boundary.error < 1e-10 and boundary.returns > 0


def test_lifetimes_diverge_at_the_boundary_crisis(boundary: udd.Crisis) -> None:
    on_it = udd.simulate(udd.DLE(5.9115), np.arange(1000.0, 3000.0, 20.0), [0.72665, -8.82437, 0.0])

    def lasting(w: float) -> udd.Lifetimes:
        model = udd.DLE(w)
        large = udd.periodic_orbit(model, settle=2000.0)
        return udd.lifetimes(model, on_it.state, large, t_max=5000.0)

    # An attractor on one side, a transient whose mean lifetime grows as a root on the other.
    assert not lasting(boundary.value + 3e-5).settled.any()
    near, far = lasting(boundary.value - 1e-4), lasting(boundary.value - 1.6e-3)
    assert far.settled.all() and near.settled.mean() > 0.95
    power = np.log(near.mean / far.mean) / np.log(16.0)
    # Grebogi, Ott and Yorke: 1/2 for a map of one dimension, at most 3/2. 100 lifetimes are good to 10 %.
    assert 0.4 < power < 1.0


@pytest.mark.nightly
def test_the_start_of_the_search_does_not_matter(boundary: udd.Crisis) -> None:
    (other,) = udd.crises(window(), n=61, depth=30)
    assert abs(other.value - boundary.value) <= other.error + boundary.error


@pytest.mark.nightly  # test_mirror_images_merge and the fixture ask for one of each kind
def test_mirror_images_merge_before_the_boundary_crisis() -> None:
    orbit = udd.periodic_orbit(udd.DLE(7.7), [1.35958, -10.21032, 0.0])
    low, high = udd.crises(udd.continuation(orbit, "w", (7.44, 7.85)))
    assert [low.kind, high.kind] == ["boundary crisis", "attractor merging crisis"]
    assert low.cycle.symmetric and high.cycle.symmetric


def test_mirror_images_merge() -> None:
    orbit = udd.periodic_orbit(udd.DLE(7.7), [1.35958, -10.21032, 0.0])
    (high,) = udd.crises(udd.continuation(orbit, "w", (7.5, 7.85)), n=30, depth=30)
    assert high.kind == "attractor merging crisis" and high.cycle.symmetric

    def sides(w: float) -> float:
        """The share of section points of one attractor on the rarer side of its mirror plane."""
        start = high.cycle.state + 1e-3
        points = udd.poincare(udd.DLE(w), n=3000, state0=start, transient=200).component("y")
        near = points[:, None] - np.unique(np.round(-points, 3))
        return float((np.abs(near).min(axis=1) < 2e-3).mean())

    # An attractor of its own has hardly a point near its image's, the merged one all of them.
    assert sides(high.value + 1e-3) < 0.5 < 0.9 < sides(high.value - 1e-3)


def test_from_a_terminal(
    boundary: udd.Crisis, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from udd.cli import main

    def known(branch: udd.Branch) -> list[udd.Crisis]:  # which takes ten seconds to find again
        assert branch.parameter == "w"
        assert branch.values.min() < boundary.value < branch.values.max()
        return [boundary]

    monkeypatch.setattr("udd.bifurcations.crises", known)
    where = ["--from", "5.9", "--to", "6.1", "--at", "6", "--state", "0.72665,-8.82437,0"]
    assert main(["continuation", "w", *where, "--crises", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["crises"]
    assert (one["kind"], one["value"]) == ("boundary crisis", boundary.value)
    span = ["--from", "1", "--to", "2", "--at", "1.5"]
    assert main(["continuation", "w", "--of", "equilibria", *span, "--crises"]) == 1
    assert "no branch of cycles" in capsys.readouterr().err


def test_what_it_does_not_serve_is_told() -> None:
    rests = udd.equilibria(udd.DLE(2.5, B=0.2))
    branch = udd.continuation(rests[0], "w", (1.0, 9.0))
    with pytest.raises(ModelError, match="a branch of cycles"):
        udd.crises(branch)
    circle = udd.Model(["x", "v"], ["v", "-sin(x)"])
    family = udd.continuation(udd.periodic_orbit(circle, [1.0, 0.0]), "period", (6.6, 7.0))
    with pytest.raises(ModelError, match="over a parameter of a model"):
        udd.crises(family)
