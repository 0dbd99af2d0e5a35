"""The catalogue of the page: parameters with units and ranges, effects, presets.

Their words are in static/texts.*.json.
"""

from __future__ import annotations

import functools
import math
from typing import Any

from udd import effects
from udd.models import DLE, Disk, Model
from udd.models.serialization import model_to_dict
from udd.report.document import text_of
from udd.report.wording import pretty

from . import limits
from .growing_run import RATE, clock_of, columns_of, per_unit
from .page_models import PLAIN, page_model
from .spec import drive_of

#: Amplitudes with which an effect is seen at once, about a tenth of what else acts on the disk.
_SHOWN = {
    ("quadratic_drag", "c"): 4e-4,
    ("cubic_drag", "c"): 8e-5,
    ("coulomb", "c"): 0.005,
    ("stribeck", "c"): 0.01,
    ("relaxation", "b"): 6.0,
    ("slip", "c"): 0.2,
    ("radial_slip", "c"): 0.003,
    ("load_drive", "a"): 0.05,
    ("lateral_slip", "c"): 0.2,
    ("wheel_ripple", "a"): 0.1,
    ("drive_ripple", "a"): 0.1,
    ("drive_drift", "a"): 0.002,
    ("tilt", "a"): 0.02,
    ("eccentric_mass", "a"): 0.02,
    ("uneven_disk", "a"): 0.02,
    ("cable_torque", "kappa"): 0.001,
    ("constant_torque", "c"): 0.01,
    ("radial_friction", "c"): 2.0,
}
_B = 43.6  # 1/m: the paper's B = 0.2 for the disk


def _presets() -> list[tuple[str, Model, list[float]]]:
    """Key of the words, model, initial state."""
    damped = Disk(0.03, effects=(effects.relaxation(b=_B),))
    root = 3.7**0.5
    return [
        ("chaos", Disk(0.03), [0.0, 0.001, 0.04, 0.0]),
        ("fig9", Disk(0.0), [0.0, 0.0463, -0.0349, 0.0]),
        ("fig10a", Disk(0.014), [0.0, 0.001, 0.04, 0.0]),
        ("fig10b", DLE(0.1), [0.0, -0.175, 1.0]),
        ("fig11a", Disk(0.039, edge="ignore"), [0.0, 0.001, 0.04, 0.0]),
        ("fig11b", Disk(0.055, edge="ignore"), [2.0, 0.02, -0.02, 0.0]),
        ("fig11c", Disk(0.071, edge="ignore"), [2.0, 0.02, -0.02, 0.0]),
        ("fig12a", DLE(3.9), [1.0, 1.0, 0.01]),
        ("fig12b", DLE(4.5), [1.0, 1.0, 0.01]),
        ("fig12c", DLE(7.1), [1.0, 1.0, 0.01]),
        ("fig16", DLE(3.7, B=0.2), [root, root, -3.2]),
        ("rotating", DLE(3.7, B=0.2), [root, root, -0.5]),
        ("bistable", DLE(7.6), [-2.0, -0.6, 0.0]),
        ("ejected", Disk(0.042), [3.0, 0.005, 0.0, 0.0]),
        ("relaxed", damped, [0.0, 0.001, 0.04, 0.0]),
    ]


@functools.cache
def catalogue() -> dict[str, Any]:
    """Return all presets as JSON values."""
    return {
        "rate": RATE,
        "limits": {
            "seconds": limits.MODEL_SECONDS,
            "rendered": limits.RENDERED,
            "upload": limits.UPLOAD,
            "points": limits.POINTS,
            "piece": limits.SAMPLES,
        },
        "models": {model.kind: _model(model) for model in (Disk(0.03), DLE(3.9))},
        "effects": [_effect_as_json(spec) for spec in effects.library() if Disk.kind in spec.bodies],
        "presets": [
            {"key": key, "model": model_to_dict(model), "state": state} for key, model, state in _presets()
        ],
    }


def _model(model: Model) -> dict[str, Any]:
    page = page_model(model)
    parameters = [
        dict(zip(("name", "least", "most", "step", "scale", "unit"), (name, *numbers), strict=True))
        for name, numbers in page.ranges.items()
    ]
    for parameter in parameters:
        name = str(parameter["name"])
        parameter["default"] = model.parameters[name]
        # A drive may stand still, though its slider begins above zero.
        parameter["floor"] = 0.0 if name == drive_of(model) else parameter["least"]
    return {
        "parameters": parameters,
        "states": list(model.state_names),
        "units": list(model.state_units),
        "columns": columns_of(model),
        "clock": clock_of(model),
        "per_unit": per_unit(model),
        "radius": PLAIN.R / page.metres,
        "surfaces": {key: component for key, (_, component) in page.surfaces.items()},
    }


def _finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None


def _effect_as_json(spec: Any) -> dict[str, Any]:
    return {
        "name": spec.name,
        "title": spec.title,
        "equation": text_of(pretty(spec.equation)),
        "meaning": spec.meaning,
        "momenta": list(spec.momenta),
        "treatments": [t for t in spec.treatments if t != "lugre"],  # one more state than is drawn
        "parameters": [
            {
                "name": p.name,
                "unit": text_of(pretty(p.unit)),
                "default": _SHOWN.get((spec.name, p.name), p.default),
                "least": _finite(p.range[0]),
                "most": _finite(p.range[1]),
            }
            for p in spec.parameters
        ],
    }
