"""Bounds of multipliers and coefficients, and labelled arrays."""

from __future__ import annotations

import numpy as np

import udd


def test_the_bounds_of_multipliers_hold() -> None:
    # On the unit circle the angle turns at the rate 1; the radius decays with exp(-2 t), u with exp(-0.3 t).
    radial = "(1 - x^2 - y^2)"
    model = udd.Model(["x", "y", "u"], [f"x*{radial} - y", f"y*{radial} + x", "-0.3*u + x*(x^2 + y^2 - 1)"])
    orbit = udd.periodic_orbit(model, [1.0, 0.0, 0.0])
    known = np.exp(-2.0 * np.pi * np.array([0.3, 2.0]))
    gaps = np.abs(orbit.multipliers - known)
    assert (gaps <= orbit.multiplier_errors).all() and (orbit.multiplier_errors < 1e-9).all()
    # The product of a symmetric cycle's is that of Liouville's formula.
    eight = udd.periodic_orbit(udd.DLE(10.0))
    relative = eight.multiplier_errors / np.abs(eight.multipliers)
    assert abs(np.log(np.abs(eight.multipliers)).sum() + eight.period) <= relative.sum() < 1e-6


def test_the_bound_of_a_first_lyapunov_coefficient_holds() -> None:
    # x' = y, y' = -x + mu y - x^2 y: -1/8 for the normal form with a length of one, times the frequency 1.
    model = udd.Model(["x", "y"], ["y", "-x + mu*y - x^2*y"], {"mu": -0.3})
    (hopf,) = udd.continuation(udd.equilibria(model)[0], "mu", (-1.0, 1.0)).find("Hopf")
    # With q = (1, i)/sqrt(2): Re<p, C(q, q, q*)>/2 = -1/4 of 2 |q_1|^2 |z|^2.
    assert abs(hopf.lyapunov_coefficient + 0.25) <= hopf.lyapunov_error < 1e-9


def test_branches_curves_and_spectra_are_labelled_arrays() -> None:
    rest = next(rest for rest in udd.equilibria(udd.DLE(2.5, B=0.2)) if rest.state[0] > 0.1)
    branch = udd.continuation(rest, "w", (1.0, 9.0))
    table = branch.to_xarray()
    assert table.w.dims == ("place",) and table.sizes["place"] == len(branch)
    assert list(table.bifurcation.values) == ["Hopf"] and table.attrs["kind"] == "equilibrium"
    np.testing.assert_array_equal(table.omega.values, branch.states[:, 0])
    np.testing.assert_array_equal(table.multiplier.values, branch.multipliers)
    curve = udd.locus(branch.points[0], "B", (0.15, 0.25))
    labelled = curve.to_xarray()
    np.testing.assert_array_equal(labelled.B.values, curve.values[:, 1])
    assert labelled.sizes["special"] == 0 and labelled.attrs["kind"] == "Hopf"
    spectrum = udd.lyapunov_spectrum(10.0)
    result = spectrum.to_xarray()
    np.testing.assert_array_equal(result.exponent.values, spectrum.exponents)
    assert result.attrs["verdict"] == spectrum.verdict
