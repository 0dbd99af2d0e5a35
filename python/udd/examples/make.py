"""Source of the example tables: ``python -m udd.examples.make`` makes them again."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.effects import library
from udd.models import Disk, Pendulum
from udd.models.formula_model import FormulaModel
from udd.simulation.model_inputs import driven as driven_by
from udd.simulation.trajectory import integrated

Array = NDArray[np.float64]

#: The model that a user would write of the driven pendulum; the record has a drag that it lacks.
DRIVEN: dict[str, Any] = {
    "states": ["theta", "omega"],
    "equations": {"theta": "omega", "omega": "-a*sin(theta) - c*omega + b*tau"},
    "parameters": {"a": 12.0, "c": 0.2, "b": 4.0},
    "angles": ["theta"],
    "inputs": ["tau"],
}


def main(folder: Path) -> None:
    """Write all example files."""
    for name, text in tables().items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def tables() -> dict[str, str]:
    """Return the example files by name."""
    return {
        "disk.csv": disk(),
        "pendulum.csv": pendulum(),
        "phone.csv": phone(),
        "driven.csv": driven(),
        "driven.json": json.dumps(DRIVEN, indent=2) + "\n",
    }


def disk(W: float = 0.042, b: float = 6.0, seconds: float = 30.0, seed: int = 1) -> str:
    """Make the record of a disk at 25 frames a second; the wheels lift it less far from the contact."""
    t = np.arange(0.0, seconds, 0.04)
    effects = (_effect("relaxation", momentum="constraint", b=b),) if b else ()
    state = integrated(Disk(W, effects=effects), t, [2.0, 0.02, -0.02, 0.0], rtol=1e-9, atol=1e-12).state
    noise = np.random.default_rng(seed).normal(size=(len(t), 3)) * [4e-4, 4e-4, 5e-3]
    return _text({"W": W, "R": 0.08}, "t,Y,Z,beta", t, state[:, 1:] + noise, (2, 5, 5, 4))


def pendulum(seed: int = 2) -> str:
    """Make the record of a pendulum of 0.65 m with quadratic drag."""
    t = np.arange(0.0, 40.0, 0.05)
    model = Pendulum(0.65, k0=0.005, effects=(_effect("quadratic_drag", c=0.02),))
    theta = integrated(model, t, [0.0, 1.0], rtol=1e-9, atol=1e-12).state[:, 1]
    noise = 2e-3 * np.random.default_rng(seed).normal(size=len(t))
    return _text({"length": 0.65}, "t,theta", t, (theta + noise)[:, None], (2, 4))


def phone(seed: int = 3) -> str:
    """Make the record of a phone's gyroscope on a pendulum of 0.8 m, with an offset, about x."""
    t = np.arange(0.0, 30.0, 0.02)
    rate = integrated(Pendulum(0.8, k0=0.012), t, [0.0, 0.6], rtol=1e-9, atol=1e-12).state[:, 0]
    noise = 0.01 * np.random.default_rng(seed).normal(size=(len(t), 3))
    axes = np.outer(rate, [1.0, 0.02, -0.01]) + np.array([0.03, -0.01, 0.02]) + noise
    shown = np.column_stack([axes, np.linalg.norm(axes, axis=1)])
    names = [f"Gyroscope {axis} (rad/s)" for axis in "xyz"]
    return _text({}, ",".join(["Time (s)", *names, "Absolute (rad/s)"]), t, shown, (2, 4, 4, 4, 4))


def driven(seed: int = 4) -> str:
    """Make the record of a driven pendulum in air, whose model lacks the quadratic drag."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, 30.0, 0.03)
    torque = 0.9 * np.sin(1.3 * t) + 0.6 * np.sin(2.9 * t + 1.0) + 0.3 * np.sin(0.4 * t)
    law = "-a*sin(theta) - c*omega + b*tau - 0.25*omega*abs(omega)"
    truth = FormulaModel(**{**DRIVEN, "equations": {"theta": "omega", "omega": law}})
    run = integrated(driven_by(truth, t, {"tau": torque}), t, [0.3, 0.0], rtol=1e-9, atol=1e-12)
    seen = run.state[:, 0] + 3e-3 * random.normal(size=len(t))
    head = "time (s),position (rad),torque (N m)"
    return _text({}, head, t, np.column_stack([seen, torque]), (2, 4, 4))


def _effect(name: str, momentum: str | None = None, **values: float) -> Any:
    spec = next(spec for spec in library() if spec.name == name)
    return spec.make(momentum=momentum, treatment=None, **values)


def _text(meta: dict[str, float], head: str, t: Array, columns: Array, digits: tuple[int, ...]) -> str:
    """Return a table with the given decimals in each column."""
    lines = [*(f"# {key} = {value}" for key, value in meta.items()), head]
    for row in np.column_stack([t, columns]).tolist():
        lines.append(",".join(f"{value:.{n}f}" for value, n in zip(row, digits, strict=True)))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
