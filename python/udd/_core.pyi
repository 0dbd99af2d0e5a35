"""The compiled core. Internal: use the functions of `udd`."""

from typing import TypedDict, final

import numpy as np
from numpy.typing import NDArray

from udd.models import Model

_Floats = NDArray[np.float64]

class _Parameter(TypedDict):
    name: str
    unit: str
    default: float
    range: tuple[float, float]
    role: str
    scan: list[float]

class _Effect(TypedDict):
    name: str
    title: str
    equation: str
    meaning: str
    slots: list[str]
    momenta: list[str]
    parameters: list[_Parameter]

class _Run(TypedDict):
    t: _Floats
    state: _Floats
    event_kind: list[str]
    event_t: _Floats
    event_state: _Floats
    outcome: str
    counts: tuple[int, int, int]
    dense: Dense | None

@final
class Dense:
    @property
    def span(self) -> tuple[float, float]: ...
    def __call__(self, t: _Floats) -> _Floats: ...

def effect_library() -> list[_Effect]: ...
def model_parameters(model: Model) -> list[tuple[str, str]]: ...
def rates(model: Model, t: _Floats, states: _Floats) -> _Floats: ...
def simulate(
    model: Model,
    times: _Floats | None,
    end: float,
    state0: list[float],
    rtol: float,
    atol: float,
    dense: bool,
) -> _Run: ...
def lyapunov(
    model: Model,
    index: int,
    values: _Floats,
    state0: list[float],
    time: float,
    transient: float,
    goal: float,
    rtol: float,
    atol: float,
) -> tuple[_Floats, _Floats, NDArray[np.bool_]]: ...
