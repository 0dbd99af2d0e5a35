"""Models with equal texts share what is parsed and recorded, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import udd


@pytest.mark.parametrize("method", ["taylor", "dopri5"])
def test_values_are_not_shared(method: str) -> None:
    # A rate of 0 is left out of the series.
    rates = [0.0, 1.0, 2.0, 0.0, 1.0]
    models = [udd.Model(["x"], ["-k*x"], {"k": k}) for k in rates]
    ends = [udd.simulate(model, [0.0, 1.0], [1.0], method=method).x[-1] for model in models]
    np.testing.assert_allclose(ends, np.exp(np.negative(rates)), rtol=1e-8)
    assert [model.rates(0.0, [1.0])[0] for model in models] == [-k for k in rates]


def test_names_and_signals_are_not_shared() -> None:
    cart = udd.Model(["x", "v"], ["v", "u"], inputs=["u"])
    pushes = [cart.with_inputs({"u": udd.InputSignal([0.0, 2.0], [0.0, top])}) for top in (4.0, 6.0, 4.0)]
    assert [push.rates(1.0, [0.0, 0.5])[1] for push in pushes] == [2.0, 3.0, 2.0]
    with pytest.raises(udd.ModelError, match="signals"):
        udd.simulate(cart, [0.0, 1.0], [0.0, 0.0])
    # The same letters, but x and v change places.
    there, back = udd.Model(["x", "v"], ["v", "-x"]), udd.Model(["v", "x"], ["v", "-x"])
    assert there.rates(0.0, [1.0, 2.0]).tolist() == [2.0, -1.0]
    assert back.rates(0.0, [1.0, 2.0]).tolist() == [1.0, -2.0]


def test_a_faulty_text_stays_faulty() -> None:
    for _ in range(2):
        with pytest.raises(udd.ModelError, match="equation of x"):
            udd.Model(["x"], ["-k*"], {"k": 1.0}).rates(0.0, [1.0])
    assert udd.Model(["x"], ["-k"], {"k": 1.0}).rates(0.0, [1.0]).tolist() == [-1.0]
