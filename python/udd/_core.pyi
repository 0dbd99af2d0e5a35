"""The compiled core. Internal: use the functions of `udd`."""

from collections.abc import Sequence
from typing import TypedDict, final

import numpy as np
from numpy.typing import NDArray

from udd.fitting.estimator_input import EstimatorInput, FilmParameters
from udd.models.base import Model
from udd.simulation.batch import Batch
from udd.tracking.marks.localization import Appearing, Picture

_Floats = NDArray[np.float64]

class _Parameter(TypedDict):
    name: str
    unit: str
    default: float
    range: tuple[float, float]
    role: str
    scan: list[float]
    along: str

class _Effect(TypedDict):
    name: str
    title: str
    equation: str
    meaning: str
    bodies: list[str]
    slots: list[str]
    momenta: list[str]
    treatments: list[str]
    parameters: list[_Parameter]

class _Run(TypedDict):
    t: _Floats
    state: _Floats
    event_kind: list[str]
    event_t: _Floats
    event_state: _Floats
    outcome: str
    counts: tuple[int, int, int, int]
    method: str
    dense: Dense | None

class _Orbits(TypedDict):
    value: _Floats
    standard_error: _Floats
    time: _Floats
    mean: _Floats
    product: _Floats
    end: _Floats
    outcome: NDArray[np.uint8]
    failure: str | None

class _Frames(TypedDict):
    states: _Floats
    growth: _Floats
    covariant: _Floats

class _Passages(TypedDict):
    states: _Floats
    end: _Floats
    t_end: _Floats
    outcome: NDArray[np.uint8]

class _Crossings(TypedDict):
    points: _Floats
    t: _Floats
    which: NDArray[np.uint8]
    found: NDArray[np.uint64]
    residual: _Floats
    end: _Floats
    t_end: _Floats
    outcome: NDArray[np.uint8]

class _Pieces(TypedDict):
    x: _Floats
    by_state: _Floats
    by_parameter: _Floats
    rate: _Floats

class _Floquet(TypedDict):
    log: _Floats
    re: _Floats
    im: _Floats
    condition: _Floats

class _Expansion(TypedDict):
    rate: _Floats
    by_state: _Floats
    by_parameter: _Floats
    surfaces: _Floats
    second: _Floats
    third: _Floats

class _Solution(TypedDict):
    states: _Floats
    sets: list[tuple[list[float], list[float], float]]
    covariance: _Floats
    state_covariance: _Floats
    misfit: _Floats
    seen_variance: _Floats
    defect: _Floats
    cost: tuple[float, float, float]
    evidence: float
    converged: bool
    iterations: int
    linear: Linearised

@final
class Linearised: ...

@final
class Dense:
    @property
    def span(self) -> tuple[float, float]: ...
    def __call__(self, t: _Floats) -> _Floats: ...

def mark_coverage(
    mark: _Floats,
    pose: _Floats,
    motion: _Floats,
    psf: float,
    window: tuple[int, int, int, int],
    local: _Floats,
) -> _Floats: ...
def align_marks(
    picture: Picture,
    disk: Appearing,
    pose: Sequence[float],
    motion: Sequence[float],
    rounds: Sequence[float],
    without: int | None = None,
    keep: bool = False,
) -> tuple[
    tuple[float, float, float],
    list[
        tuple[
            tuple[float, float],
            tuple[float, float, float, float],
            tuple[float, float, float, float],
            tuple[int, int, int, int],
            tuple[_Floats, _Floats] | None,
        ]
        | None
    ],
    list[bool],
    tuple[list[float], list[list[float]], list[list[float]], list[float]] | None,
    float,
]: ...
def require_memory(what: str, bytes: float) -> None: ...
def formula_bodies(name: str, spec: tuple[str, str, list[str], list[str]]) -> list[str]: ...
def formula_operations(
    text: str, variables: list[str], parameters: list[str] = ...
) -> list[tuple[str, int, float]]: ...
def make_machine_code(when: str) -> None: ...
def growing_components(model: Model, t: float, states: _Floats) -> list[int]: ...
def has_series(model: Model) -> bool: ...
def effect_library() -> list[_Effect]: ...
def model_kinds() -> list[str]: ...
def model_parameters(model: Model) -> list[tuple[str, str]]: ...
def observed(model: Model, t: _Floats, states: _Floats) -> _Floats: ...
def rates(model: Model, t: _Floats, states: _Floats) -> _Floats: ...
def simulate(
    model: Model,
    times: _Floats | None,
    end: float,
    state0: list[float],
    rtol: float,
    atol: float,
    max_step: float,
    method: str,
    dense: bool,
) -> _Run: ...
def ensemble(batch: Batch, times: _Floats, method: str) -> _Passages: ...
def frames(
    model: Model, state0: list[float], dt: float, count: int, rtol: float, atol: float, max_step: float
) -> _Frames: ...
def lyapunov(batch: Batch, all: bool, time: float, transient: float, goal: float) -> _Orbits: ...
def sections(
    batch: Batch, section: list[tuple[str, int]], skip: int, count: int, t_max: float
) -> _Crossings: ...
def shoot(
    model: Model,
    values: _Floats,
    starts: _Floats,
    t: _Floats,
    spans: _Floats,
    wanted: list[int],
    rtol: float,
    atol: float,
) -> _Pieces: ...
def expansion(model: Model, t: float, x: list[float], all: bool) -> _Expansion: ...
def floquet(factors: _Floats) -> _Floquet | None: ...
def solve(problem: EstimatorInput, iterations: int, decrease: float) -> _Solution: ...
def score(
    problem: EstimatorInput,
    candidates: list[tuple[Model, list[int]]],
) -> tuple[_Floats, _Floats, _Floats]: ...
def score_ripples(problem: EstimatorInput, frequencies: list[float]) -> tuple[_Floats, _Floats, _Floats]: ...
def responses(problem: EstimatorInput) -> tuple[_Floats, _Floats, _Floats]: ...
def score_columns(
    problem: EstimatorInput, at_end: _Floats, groups: list[int]
) -> tuple[_Floats, _Floats, _Floats]: ...
def filter(problem: EstimatorInput, windows: list[tuple[int, int]]) -> tuple[_Floats, _Floats, _Floats]: ...
def innovations(problem: EstimatorInput, vague: list[float]) -> _Floats: ...
def predict(
    model: Model,
    films: Sequence[FilmParameters],
    film: list[int],
    t0: _Floats,
    states: _Floats,
    times: _Floats,
) -> _Floats: ...
def camera_parameters(kind: str) -> list[tuple[str, str]]: ...
