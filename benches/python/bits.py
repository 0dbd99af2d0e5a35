"""Digests of what the package computes, one line each: whether a change of the code changed a bit.

python benches/python/bits.py > before.txt       # from the code before
python benches/python/bits.py --against before.txt
python benches/python/bits.py --only spectrum,poincare

The results of runs, exponents, sections and branches are the same on every machine. Fits, discoveries and
tracked films go through the machine's linear algebra and video codecs: compare them on one machine only.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

import udd

LORENZ = udd.Model(
    ["x", "y", "z"],
    {"x": "sigma*(y - x)", "y": "x*(rho - z) - y", "z": "x*y - beta*z"},
    {"sigma": 10.0, "rho": 28.0, "beta": 8 / 3},
)
DISK = udd.Model(
    ["Omega", "Y", "Z", "beta"],
    {
        "Omega": "(g*Y - max(k1 - k2*abs(Omega), k0)*Omega - W*Z*Omega)/(R^2/2 + Y^2 + Z^2)",
        "Y": "Z*Omega",
        "Z": "W - Y*Omega",
        "beta": "Omega",
    },
    udd.Disk(0.039).parameters,
)
RUBBING = udd.Model(
    ["x", "v"],
    {
        "x": "v",
        "v": "cos(1.1*t) - x - x^2*x/4 - c*sign(v) - min(v, c)*where(x > 0.2, v^2, abs(x - 1)) + c*x*v",
    },
    {"c": 0.3},
)
SWING = udd.Model(["theta", "v"], {"theta": "v", "v": "-4*sin(theta) - tanh(v)/9 + cos(1.4*t)"}, {"F": 1.0})
GRIPPING = udd.Disk(0.039, effects=[udd.effects.relaxation(b=6.0), udd.effects.quadratic_drag(c=0.01)])
DRY = udd.Pendulum(0.5, effects=[udd.effects.coulomb(c=0.05, treatment="set-valued")])

#: Model and state of each run.
RUNS = {
    "DLE": (udd.DLE(1.0), [1, 1, 0.01]),
    "damped DLE": (udd.DLE(3.7, B=0.2), [1.9, 1.9, -3.2]),
    "disk": (udd.Disk(0.039), [0, 0.001, 0.04, 0]),
    "disk with effects": (GRIPPING, [0, 0.001, 0.04, 0]),
    "pendulum": (udd.Pendulum(0.5), [0.0, 1.0]),
    "pendulum that sticks": (DRY, [0.0, 1.0]),
    "Lorenz as text": (LORENZ, [1, 1, 1]),
    "swing as text": (SWING, [0.5, 0.0]),
    "disk as text": (DISK, [3.0, 0.005, 0.0, 0.0]),
    "friction as text": (RUBBING, [0.5, 0.0]),
}


def _runs() -> Iterator[tuple[str, Callable[[], list[object]]]]:
    times = np.linspace(0, 20, 201)
    for name, (model, start) in RUNS.items():
        for method in ("dopri5", "dop853", "taylor"):
            for rtol in (1e-6, 1e-10):
                yield (
                    f"simulate, {name}, {method}, rtol {rtol:g}",
                    lambda m=model, s=start, how=method, r=rtol: [
                        udd.simulate(m, times, s, method=how, rtol=r).state
                    ],
                )
    rng = np.random.default_rng(1)
    starts = rng.normal(size=(200, 3))
    yield "ensemble, DLE", lambda: [udd.ensemble(udd.DLE(1.0), [0, 20, 40], starts, rtol=1e-6).state]
    yield (
        "ensemble, DLE, dopri5",
        lambda: [udd.ensemble(udd.DLE(1.0), [0, 20], starts, rtol=1e-6, method="dopri5").state],
    )
    yield "ensemble, Lorenz as text", lambda: [udd.ensemble(LORENZ, [0, 5], starts, rtol=1e-6).state]
    disks = np.column_stack(
        [rng.normal(size=(100, 2)) * [2, 0.01], 0.02 * rng.normal(size=100), np.zeros(100)]
    )
    yield (
        "ensemble, disk",
        lambda: [udd.ensemble(udd.Disk(0.039), [0, 5, 10], disks, method="dopri5").state],
    )


def _chaos() -> Iterator[tuple[str, Callable[[], list[object]]]]:
    yield "lyapunov, drives", lambda: [udd.lyapunov(np.linspace(0.5, 10, 40), t=500.0)]
    yield "lyapunov, disk", lambda: [udd.lyapunov(udd.Disk(0.014, edge="ignore"), t=200.0)]
    for name in ("DLE", "disk", "Lorenz as text"):
        model = udd.Disk(0.014, edge="ignore") if name == "disk" else RUNS[name][0]

        def spectrum(m: object = model, start: object = RUNS[name][1]) -> list[object]:
            answer = udd.lyapunov_spectrum(m, t=400.0, state0=start)
            return [answer.exponents, answer.standard_errors]

        yield f"spectrum, {name}", spectrum
    yield "poincare, DLE", lambda: [udd.poincare(udd.DLE(1.0), n=500).state]
    yield "poincare, maxima", lambda: [udd.poincare(udd.DLE(1.0), "maxima of z", 500).state]
    yield "poincare, disk", lambda: [udd.poincare(udd.Disk(0.014), "Z", 200).state]
    yield "poincare, Lorenz as text", lambda: [udd.poincare(LORENZ, "z = 27", 300, state0=[1, 1, 1]).state]


def _attractors() -> Iterator[tuple[str, Callable[[], list[object]]]]:
    def bifurcation() -> list[object]:
        diagram = udd.bifurcation(udd.DLE(1.0), "w", np.linspace(6.5, 8, 24), path="both")
        return [
            diagram[name].values for name in sorted(diagram.data_vars) if diagram[name].dtype.kind in "fiu"
        ]

    def basins() -> list[object]:
        axis = np.linspace(-4, 4, 16)
        diagram = udd.basins(udd.DLE(7.6), {"omega": axis, "z": axis}, state0=[0, 0.5, 0])
        return [
            diagram[name].values for name in sorted(diagram.data_vars) if diagram[name].dtype.kind in "fiu"
        ]

    def continuation() -> list[object]:
        branch = udd.continuation(udd.periodic_orbit(udd.DLE(10.0)), "w", (6.5, 12.0))
        return [np.array([point.value for point in branch.points])]

    yield "bifurcation, DLE", bifurcation
    yield "basins, DLE", basins
    yield "periodic orbit, DLE", lambda: [np.array([udd.periodic_orbit(udd.DLE(10.0)).period])]
    yield "continuation, DLE", continuation


def _loop() -> Iterator[tuple[str, Callable[[], list[object]]]]:
    run = udd.simulate(GRIPPING, np.arange(0, 20, 0.04), [0, 0.001, 0.04, 0], method="dopri5")
    seen = run.state[:, 1:] + np.random.default_rng(2).normal(size=(len(run.t), 3)) * [3e-4, 3e-4, 5e-3]
    table = udd.Measurement(run.t, seen).with_meta(W=0.039, R=0.08)

    def fit() -> list[object]:
        answer = udd.fit(table, udd.Disk(0.039))
        return [np.array([answer.parameters[name] for name in sorted(answer.parameters)])]

    def discovery() -> list[object]:
        answer = udd.discover(table, udd.Disk(0.039))
        return [answer.verdict.encode(), *(effect.expression.encode() for effect in answer.effects)]

    def film() -> list[object]:
        with as_file(files("udd") / "demo" / "sample.mp4") as path:
            return [udd.track(path).values]

    def drawn() -> list[object]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "drawn.mp4")
            udd.render(run, path)
            return [path.read_bytes()]

    yield "fit", fit
    yield "discover", discovery
    yield "render", drawn
    yield "track", film


def _digest(parts: list[object]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part if isinstance(part, bytes) else np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:16]


def main() -> None:
    """Print a digest for each result; with --against, fail where one differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="those whose name holds one of these words")
    parser.add_argument("--against", type=Path, help="what this printed before")
    chosen = parser.parse_args()
    words = [word.strip() for word in chosen.only.split(",")]
    before = {}
    if chosen.against:
        before = dict(line.split("  ", 1)[::-1] for line in chosen.against.read_text().splitlines())
    warnings.simplefilter("ignore")
    changed = 0
    for part in (_runs, _chaos, _attractors, _loop):
        for name, result in part():
            if not any(word in name for word in words):
                continue
            digest = _digest(result())
            differs = chosen.against is not None and before.get(name) != digest
            changed += differs
            print(f"{digest}  {name}" + ("   CHANGED" if differs else ""), flush=True)
    if chosen.against:
        print(f"{changed} changed", file=sys.stderr)
    sys.exit(changed > 0)


if __name__ == "__main__":
    main()
