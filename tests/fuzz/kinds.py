"""Hostile inputs by kind: a case draws an input and lets only results and clear refusals pass."""

from __future__ import annotations

import contextlib
import inspect
import io
import itertools
import linecache
import signal
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DataObject
from scipy.integrate import solve_ivp

import udd
from public_calls import calls
from udd.video.reader import Film

PACKAGE = str(Path(udd.__file__).parent)
LONGEST_MESSAGE = 500  # characters
EVALUATIONS = 20_000  # of a law, by SciPy's method

# Ctrl-C is pressed after so many seconds of processor time, or of waiting.
PATIENCE, WAIT = 2.0, 60.0
# A call may go on for so many seconds of processor time after that.
DEAF = 0.3


class Fault(AssertionError):
    """A case that broke a promise of the package."""


def is_clear(error: BaseException) -> bool:
    """Return True if a statement of the package or the core raised an error, with a sentence of its own."""
    if isinstance(error, udd.UddError):
        return True
    if not isinstance(error, ValueError | TypeError | MemoryError | OSError):
        return False
    last = traceback.extract_tb(error.__traceback__)[-1]
    line = linecache.getline(last.filename, last.lineno or 0)
    is_raised_here = "raise" in line or "_core." in line or "core." in line
    is_python_call = isinstance(error, TypeError) and "argument" in str(error) and "()" in str(error)
    return is_python_call or (last.filename.startswith(PACKAGE) and is_raised_here)


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Let a case end in a result or a clear refusal, and press Ctrl-C after `PATIENCE`."""
    is_pressed = False
    # Processor time: on a busy machine a call waits for its turn.
    start = time.process_time()

    def press(*_: object) -> None:
        nonlocal is_pressed
        is_pressed = True
        raise KeyboardInterrupt

    timers = {signal.SIGPROF: (signal.ITIMER_PROF, PATIENCE), signal.SIGALRM: (signal.ITIMER_REAL, WAIT)}
    before = {number: signal.signal(number, press) for number in timers}
    for timer, seconds in timers.values():
        signal.setitimer(timer, seconds)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except KeyboardInterrupt:
        if not is_pressed:
            raise
    except Exception as error:
        if not is_clear(error):
            raise Fault(f"{type(error).__name__}: {error}") from error
        if len(str(error)) > LONGEST_MESSAGE:
            raise Fault(f"a message of {len(str(error))} characters: {str(error)[:100]}...") from error
    finally:
        for timer, _ in timers.values():
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
    # From the signal on, which Python itself hears only once a call of the core is over.
    deaf = time.process_time() - start - PATIENCE
    if is_pressed and deaf > DEAF:
        raise Fault(f"deaf to Ctrl-C for {deaf:.1f} s")


# --- formulas

NAMES = ["x", "v", "t", "a", "pi"]
FUNCTIONS = [
    "sin",
    "cos",
    "exp",
    "ln",
    "sqrt",
    "abs",
    "sign",
    "tanh",
    "sinh",
    "cosh",
    "tan",
    "atan",
    "nosuch",
]
NUMBERS = ["0", "1", "2", "0.5", "1e300", "1e-300", "1e999", "-3", "2.0"]


def expressions() -> st.SearchStrategy[str]:
    """Formulas of names, numbers, functions and operators, most of them well formed."""

    def extended(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        return st.one_of(
            st.tuples(inner, st.sampled_from("+-*/^"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})"),
            st.tuples(st.sampled_from(FUNCTIONS), inner).map(lambda p: f"{p[0]}({p[1]})"),
            st.tuples(inner, inner, inner).map(lambda p: f"where({p[0]} > 0, {p[1]}, {p[2]})"),
            st.tuples(st.sampled_from(["min", "max", "atan2"]), inner, inner).map(
                lambda p: f"{p[0]}({p[1]}, {p[2]})"
            ),
        )

    return st.recursive(st.sampled_from(NAMES + NUMBERS), extended, max_leaves=12)


def formulas(data: DataObject) -> None:
    """Build a model of drawn formulas or drawn text and run it."""
    text = st.text(alphabet="xvta0123456789.+-*/^(),<>&|=! e\n\0é", max_size=40)
    rates = [data.draw(expressions() | text) for _ in range(2)]
    method = data.draw(st.sampled_from(["dopri5", "dop853", "taylor", "rodas", "auto"]))
    start = [data.draw(st.floats(-5, 5)) for _ in range(2)]
    with watched():
        model = udd.Model(["x", "v"], rates, {"a": data.draw(st.floats(-3, 3))})
        run = udd.simulate(
            model, data.draw(st.sampled_from([0.0, 0.1, 1.0, -1.0, 1e-320])), start, method=method
        )
        if run.outcome == "finished" and not np.isfinite(run.state).all():
            raise Fault(f"a finished run with states that are not finite: {rates}")


def differential(data: DataObject) -> None:
    """Compare all methods with SciPy's DOP853 on a smooth drawn law."""
    terms = ["x", "v", "sin(x)", "cos(t)", "x*v", "x^2", "v^2", "tanh(v)", "exp(-x^2)", "1"]
    numbers = st.floats(-2, 2).map(lambda value: round(value, 3))
    rates = [
        " + ".join(
            f"({data.draw(numbers)})*{term}"
            for term in data.draw(st.lists(st.sampled_from(terms), min_size=1, max_size=4))
        )
        for _ in range(2)
    ]
    start = [data.draw(st.floats(-2, 2)) for _ in range(2)]
    model = udd.Model(["x", "v"], rates)
    t_end = 2.0

    def reference(rtol: float) -> Any:
        evaluations = itertools.count()

        def rates(t: float, x: Any) -> Any:
            if next(evaluations) > EVALUATIONS:
                raise OverflowError  # next to a pole SciPy goes on for minutes
            return model.rates(t, x)

        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return solve_ivp(
                rates,
                (0, t_end),
                start,
                method="DOP853",
                rtol=rtol,
                atol=rtol * 1e-2,
            )

    try:
        coarse, fine = reference(1e-9), reference(1e-12)
    except OverflowError:
        return
    if not (coarse.success and fine.success) or np.abs(fine.y).max() > 1e6:
        return
    allowed = 1e-6 * (1 + np.abs(fine.y[:, -1])) + 1e3 * np.abs(coarse.y[:, -1] - fine.y[:, -1])
    for method in ("dopri5", "dop853", "taylor", "rodas", "auto"):
        with watched():
            run = udd.simulate(model, t_end, start, method=method)
            if run.outcome == "finished" and (np.abs(run.state[-1] - fine.y[:, -1]) > allowed).any():
                raise Fault(f"{method} of {rates} from {start}: {run.state[-1]}, SciPy has {fine.y[:, -1]}")


# --- arguments of public functions

ODD: list[Any] = [
    *(None, True, -1, 0, 1, 2.5, 2**31, 2**53 + 1, 10**400, 1e308, 5e-324, float("nan"), float("inf"), 1j),
    *(
        "",
        "x",
        "nosuch",
        "a" * 5000,
        b"x",
        "\0",
        [],
        [[]],
        [1],
        [1, "x"],
        [None],
        [[1], [1, 2]],
        (),
        {},
        {"x": 1},
    ),
    *(set(), object(), lambda: 0, np.zeros(0), np.zeros((2, 0, 3)), np.array(["a"]), np.array([None])),
    *(
        np.full(3, np.nan),
        np.datetime64("2026-01-01"),
        1e-320,
        [1e-320, float("inf")],
        [True, 1],
        {"x": None},
        {1: 2},
        np.ones((3, 3), object),
        np.ones(3, np.complex128),
        "a/b\0c",
        b"\xff",
        type,
        Path("nosuch/file"),
        Exception("x"),
        range(3),
        slice(None),
    ),
]


# These take long with valid arguments, too: they are called with one argument that is wrong.
ODD_ONLY = {
    "discover": "measurement",
    "prune": "measurement",
    "track": "video",
    "render": "trajectory",
    "sweep": "spec",
}


def arguments(data: DataObject) -> None:
    """Call a public function with one or two arguments that are odd, optional ones among them."""
    name = data.draw(st.sampled_from([*calls(), *ODD_ONLY]))
    if name in ODD_ONLY:
        with watched():
            getattr(udd, name)(
                data.draw(st.sampled_from(ODD)), *([None] if name in ("discover", "prune", "render") else [])
            )
        return
    function, given = calls()[name]
    changed = dict(given)
    names = sorted({*given, *optional_arguments(function), "nosuch"})
    for key in data.draw(st.lists(st.sampled_from(names), min_size=1, max_size=2, unique=True)):
        changed[key] = data.draw(st.sampled_from(ODD))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), watched(), quiet():
        function(**changed)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Swallow what a call prints, such as the line of its progress."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        yield


def optional_arguments(function: Callable[..., Any]) -> list[str]:
    """The names of the arguments that a function takes by name."""
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [name for name, one in inspect.signature(function).parameters.items() if one.kind in named]


# --- tables and files


def mutated(sample: bytes, data: DataObject) -> bytes:
    """Return a sample with some of its bytes replaced, removed, repeated or cut off."""
    changed = bytearray(sample)
    for _ in range(data.draw(st.integers(1, 6))):
        if not changed:
            break
        at = data.draw(st.integers(0, len(changed) - 1))
        what = data.draw(st.sampled_from(["replace", "remove", "repeat", "cut", "insert"]))
        if what == "replace":
            changed[at] = data.draw(st.integers(0, 255))
        elif what == "remove":
            del changed[at : at + data.draw(st.integers(1, 40))]
        elif what == "repeat":
            changed[at:at] = changed[at : at + data.draw(st.integers(1, 60))] * data.draw(st.integers(1, 20))
        elif what == "cut":
            del changed[at:]
        else:
            changed[at:at] = data.draw(st.binary(max_size=12))
    return bytes(changed)


TABLE = "# R = 0.08\n# W = 0.039\nt,theta,sigma_theta\n" + "\n".join(
    f"{k / 30},{0.1 * k % 3},0.001" for k in range(20)
)
TABLES = [
    TABLE,
    TABLE.replace(",", ";").replace(".", ","),
    TABLE.replace(",", "\t"),
    '"Zeit / s";"Winkel / rad"\n'
    + "\n".join(f"{k / 20:.3f};{0.1 * k:.3f}".replace(".", ",") for k in range(20)),
]


def read(content: bytes, name: str) -> None:
    """Read a measurement from a file of this content."""
    with tempfile.TemporaryDirectory() as folder, watched():
        path = Path(folder) / name
        path.write_bytes(content)
        udd.read_measurement(path)


def csv(data: DataObject) -> None:
    """Read a table with a mutated text."""
    read(mutated(data.draw(st.sampled_from(TABLES)).encode(), data), "table.csv")


@cache
def samples() -> dict[str, bytes]:
    """Return a small valid file of each compiled format."""
    t = np.linspace(0, 2, 60)
    record = udd.Measurement(t, {"theta": 0.2 * np.exp(-0.1 * t) * np.sin(t)})
    fit = udd.fit(record, udd.Pendulum(9.81))
    made: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        writers: dict[str, Callable[[Path], object]] = {
            "a.udd": lambda path: udd.save(fit, path),
            "a.parquet": record.to_parquet,
            "a.h5": lambda path: _to_hdf5(path, t),
            "a.mat": lambda path: _to_mat(path, t),
        }
        for name, write in writers.items():
            with contextlib.suppress(ImportError):
                write(Path(folder) / name)
                made[name] = (Path(folder) / name).read_bytes()
    zipped = io.BytesIO()
    with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Gyroscope.csv", TABLE)
    made["a.zip"] = zipped.getvalue()
    return made


def _to_hdf5(path: Path, t: Any) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["t"], file["theta"] = t, np.sin(t)


def _to_mat(path: Path, t: Any) -> None:
    from scipy.io import savemat

    savemat(path, {"t": t, "theta": np.sin(t)})


def files(data: DataObject) -> None:
    """Read a file of a compiled format with mutated bytes."""
    name = data.draw(st.sampled_from(sorted(samples())))
    content = mutated(samples()[name], data)
    if name.endswith(".udd"):
        with tempfile.TemporaryDirectory() as folder, watched():
            path = Path(folder) / name
            path.write_bytes(content)
            udd.load(path)
    else:
        read(content, name)


def films(data: DataObject) -> None:
    """Read the frames of a film with mutated bytes, through the decoder's process."""
    sample = (Path(udd.__file__).parent / "demo" / "sample.mp4").read_bytes()
    with tempfile.TemporaryDirectory() as folder, watched():
        path = Path(folder) / "film.mp4"
        path.write_bytes(mutated(sample, data))
        pictures = Film(path).pictures()
        with contextlib.closing(pictures):  # type: ignore[type-var]
            for _ in zip(range(5), pictures, strict=False):
                pass


def specifications(data: DataObject) -> None:
    """Read a sweep's specification with a mutated TOML or JSON text."""
    toml = (
        'quantity = "lyapunov"\nchunk = 4\n[model]\nkind = "dle"\nw = 1.0\n'
        "[over.w]\nfrom = 0.5\nto = 2.0\nn = 4\n[options]\ntol = 0.02\n"
    )
    json = (
        '{"quantity": "final_state", "model": {"kind": "dle", "w": 1.0}, '
        '"over": {"w": [1, 2]}, "options": {"t": 5}}'
    )
    name, sample = data.draw(st.sampled_from([("a.toml", toml), ("a.json", json)]))
    with tempfile.TemporaryDirectory() as folder, watched():
        path = Path(folder) / name
        path.write_bytes(mutated(sample.encode(), data))
        udd.SweepSpec.read(path)


KINDS: dict[str, Callable[[DataObject], None]] = {
    kind.__name__: kind for kind in (formulas, differential, arguments, csv, files, films, specifications)
}
