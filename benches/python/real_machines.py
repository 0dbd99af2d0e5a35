"""Real machines: known model, what is found missing, free runs before and after.

    python benches/python/real_machines.py FOLDER [--only silverbox,chain,pendulums] [--json out.json]

FOLDER holds the records; see `docs/real-machines.md` for where they are published. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import udd

RATE = 610.35  # Hz, of the Silverbox
ARROW = 40_700  # its first samples: the test signal, whose amplitude grows beyond that of all others
LENGTH = 4096  # samples of an estimation stretch, half a period of a multisine
STARTS = (50_000, 70_000, 90_000)  # in three of the multisine's realisations
SETTLED = 500  # samples after which the start is forgotten
HORIZONS = (0.1, 0.5, 1.0, 2.0)  # s
ROTOR, GEAR = 7.66e-5, 6.0  # kg m^2 and turns of the double pendulum's motors, as published
#: The dry friction of its joints, as published, N m.
COULOMB = [
    udd.effects.formula("force(a1)", "-c*tanh(w1/0.1)", name="first", c=0.093),
    udd.effects.formula("force(a2 - a1)", "-c*tanh((w2 - w1)/0.1)", name="second", c=0.078),
]


def silverbox(folder: Path) -> list[dict[str, Any]]:
    """An electronic Duffing oscillator, known but for its springs' nonlinearity."""
    table = np.genfromtxt(folder / "silverbox_snls80mv.csv", delimiter=",", names=True)
    drive, seen = table["V1"], table["V2"]

    def part(first: int, last: int) -> udd.Measurement:
        t = np.arange(last - first) / RATE
        signal = udd.InputSignal(t, drive[first:last], hold="cubic")
        return udd.Measurement(t, {"y": seen[first:last]}, inputs={"u": signal})

    known = udd.Model(["y", "v"], ["v", "-k*y - c*v + b*u"], {"k": 1.7e5, "c": 50.0, "b": 1e5}, inputs=["u"])
    arrow = part(0, ARROW)

    def error(model: Any) -> float:
        """R.m.s. of a free run over the arrow, mV."""
        bound = model.with_inputs(arrow.inputs)
        run = udd.simulate(bound, arrow.t, [arrow["y"][0], 0.0], method="auto", rtol=1e-8, atol=1e-10)
        return 1e3 * float(np.sqrt(np.mean((run.y - arrow["y"])[SETTLED:] ** 2)))

    rows = []
    for start in STARTS:
        record = part(start, start + LENGTH)
        since = time.perf_counter()
        before, result = udd.fit(record, known), udd.discover(record, known)
        rows.append(
            {
                "machine": f"Silverbox, samples {start} to {start + LENGTH}",
                "verdict": str(result.verdict),
                "effects": [effect.title or effect.name for effect in result.model.effects],
                "before": error(before.model),
                "after": error(result.model),
                "unit": "mV",
                "seconds": time.perf_counter() - since,
            }
        )
    return rows


def chain(folder: Path) -> list[dict[str, Any]]:
    """A double pendulum with motors, known but for dry friction in its joints.

    Masses, lengths, gear and rotors are taken as published; inertias, centres of mass and viscous friction
    are free.
    """

    def read(name: str) -> udd.Measurement:
        table = np.genfromtxt(folder / f"double_pendulum_A_{name}.csv", delimiter=",", names=True)
        t = table["time"]
        torques = {f"tau{k}": udd.InputSignal(t, table[f"tau_meas{k}"]) for k in (1, 2)}
        first = table["pos_meas1"]
        return udd.Measurement(t, {"a1": first, "a2": first + table["pos_meas2"]}, inputs=torques)

    fitted, other = read("00"), read("05")
    known = udd.pendulum_chain(
        [0.5594, 0.6043],
        [0.3, 0.2],
        [0.3, 0.18378],
        [0.05347, 0.02392],
        friction=[0.001, 0.001],
        rotors=[ROTOR * GEAR**2] * 2,
        motors=True,
    )
    since = time.perf_counter()
    discovery = udd.discover(fitted, known, free=["I1", "I2", "r1", "r2", "b1", "b2"])
    took = time.perf_counter() - since

    def errors(fit: udd.Fit) -> list[float]:
        """Median over the starts of free runs' errors on the record that no fit saw, rad, at each horizon."""
        off = []
        for start in np.arange(1.0, 7.9, 0.1):
            ahead = udd.forecast(
                other, fit, [0.0, *HORIZONS], start=start, window=0.5, members=2, process=False
            )
            seen = np.column_stack([np.interp(ahead.t, other.t, other[name]) for name in ahead.names])
            off.append((ahead.median - seen)[1:])
        return np.median(np.sqrt(np.mean(np.square(off), axis=2)), axis=0).tolist()

    unit = f"rad at {', '.join(f'{h:g}' for h in HORIZONS)} s"
    return [
        {
            "machine": "double pendulum, A_00 fitted, A_05 forecast",
            "verdict": str(discovery.verdict),
            "effects": [effect.title or effect.name for effect in discovery.model.effects],
            "numbers": {n: (v, discovery.fit.errors[n]) for n, v in discovery.fit.parameters.items()},
            "before": errors(discovery.baseline),
            "after": errors(discovery.fit),
            "unit": unit,
            "seconds": took,
        },
        {
            "machine": "the same with the published numbers, without dry friction and with it",
            "verdict": "none sought",
            "effects": [],
            "before": errors(udd.fit(fitted, known, free=[])),
            "after": errors(udd.fit(fitted, known.with_effects(COULOMB), free=[])),
            "unit": unit,
            "seconds": 0.0,
        },
    ]


#: Free pendulums: their file, its columns, and the length that belongs to their period, m.
PENDULUMS = {
    "string, 1.47 m": ("string_pendulum_a.txt", None, 1.47),
    "string, 1.13 m": ("string_pendulum_b.txt", None, 1.13),
    "string, 0.90 m": ("string_pendulum_c.txt", None, 0.90),
    "string, 0.61 m": ("string_pendulum_d.txt", None, 0.61),
    "cup, 0.65 m": ("cup_pendulum.txt", "t,theta,_", 0.65),
    "laboratory, 7.4 m": ("lab_pendulum.txt", "_,t,theta,_", 7.4),
}


def pendulums(folder: Path) -> list[dict[str, Any]]:
    """Six free pendulums, known but for what takes their energy beside viscous friction."""
    rows = []
    for name, (file, columns, length) in PENDULUMS.items():
        measured = udd.read_measurement(folder / file, columns=columns)
        since = time.perf_counter()
        discovery = udd.discover(measured, udd.Pendulum(length, k0=0.01 * length**2))
        rows.append(
            {
                "machine": name,
                "verdict": str(discovery.verdict),
                "effects": [effect.title or effect.name for effect in discovery.model.effects],
                "ratio": discovery.ratio,
                "before": 1e3 * discovery.error_before.whole,
                "after": 1e3 * discovery.error_after.whole,
                "unit": "mrad",
                "seconds": time.perf_counter() - since,
            }
        )
    return rows


MACHINES: dict[str, Callable[[Path], list[dict[str, Any]]]] = {
    "silverbox": silverbox,
    "chain": chain,
    "pendulums": pendulums,
}


def said(value: float | list[float]) -> str:
    return ", ".join(f"{one:.3g}" for one in (value if isinstance(value, list) else [value]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default=",".join(MACHINES))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    print("| record | verdict | found | free run before | after | s |\n|---|---|---|---|---|---|")
    for name in options.only.split(","):
        for row in MACHINES[name](options.folder):
            rows.append(row)
            result = "; ".join(row["effects"]) or "nothing"
            errors = f"{said(row['before'])} {row['unit']} | {said(row['after'])} {row['unit']}"
            cells = f"{row['machine']} | {row['verdict']} | {result} | {errors} | {row['seconds']:.0f}"
            print(f"| {cells} |", flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
