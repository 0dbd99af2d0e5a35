"""Fits and discoveries as files that are read back without running anything in them.

A file is NumPy's ``.npz``: the arrays, and one JSON text (`tree`, UTF-8) that says what they belong to. It
lists objects, each once, parts before wholes; ``{"object": 3}`` and ``{"array": 5}`` refer to entries.
Reading a file makes only the types listed here.
"""

from __future__ import annotations

import functools
import io
import json
import math
import os
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from udd import _core
from udd._util.arguments import checked_arguments
from udd._util.atomic_files import write_whole
from udd._util.input_files import LARGEST, NESTED, MemoryLimit, read_regular
from udd._util.numpy_files import arrays_of
from udd._util.schema import consistent, is_a
from udd.discovery import Discovery
from udd.discovery.nonparametric.bsplines import Spline
from udd.discovery.nonparametric.curve_scan import Curve
from udd.discovery.nonparametric.penalized_curves import Confounding
from udd.discovery.results import AddedEffect, Alternative, RejectedEffect
from udd.discovery.scoring.candidate import Candidate
from udd.discovery.scoring.coordinates import Slot, coordinate, slots
from udd.discovery.scoring.forcing import Score
from udd.discovery.scoring.score_scan import Scored
from udd.discovery.validation.by_record import RecordAnswer
from udd.discovery.validation.held_out_errors import Errors
from udd.effects import Effect
from udd.errors import ModelError, UddError
from udd.fitting import Fit, diagnostics
from udd.fitting.estimator_input import FilmParameters
from udd.fitting.input_noise import NoisyInput
from udd.fitting.noise import Noise
from udd.fitting.parameters import Free
from udd.fitting.problem import Point, Problem
from udd.fitting.record import Record
from udd.fitting.thinning import Thinned
from udd.measurement import InputSignal, Measurement
from udd.models import Model
from udd.models.formula_model import FormulaModel
from udd.models.profile import Coordinate
from udd.models.serialization import effect_from_dict, effect_to_dict, model_from_dict, model_to_dict

FORMAT = "udd result 1"
"""Change it with every change of the content of a file."""

_TYPES: dict[str, type] = {
    cls.__name__: cls
    for cls in (
        *(Fit, Problem, Point, Record, Noise, Free, InputSignal, Measurement, Thinned),
        *(diagnostics.Diagnostics, diagnostics.ModelError, diagnostics.Reading, diagnostics.RunawayParameter),
        NoisyInput,
        *(Discovery, AddedEffect, Alternative, RejectedEffect, RecordAnswer, Candidate, Scored, Errors),
        *(Curve, Spline, Score, Confounding),
    )
}
#: Shapes of what goes together: n frames, m channels, d states, p free parameters, l links, f films.
_SHAPES = {
    "Record": "t:n seen:nm sigma:nm rho:nmm linked:l states:nd odd:n row:n film:n origins:f",
    "Problem": "record.t:n record.seen:nm noise.weight:n noise.factor:m models:f record.origins:f",
    "Noise": "factor:m blur:m memory:m weight:n",
    "Fit": "record.t:n record.seen:nm record.linked:l states:nd state_covariance:ndd misfit:nm defect:ld "
    "misfit_variance:nm noise.factor:m noise.weight:n parameters:p errors:p covariance:pp problem.free:p "
    "point.states:nd models:f measurements:f point.sets:f record.origins:f",
    "Errors": "horizons:h median:h low:h high:h floor:h samples:sh blocks:s run:r run_blocks:r",
    "Curve": "coefficients:k covariance:kk score.gradient:k score.information:kk coordinates:c splines:c "
    "places:c",
    "Score": "gradient:k information:kk alone:k",
    "Confounding": "rows:ak vectors:ka",
    "Discovery": "scans:s curves:s comparisons:s",
}
#: Types and fields that were called otherwise in files of before.
_BEFORE = {"Absorbed": "Confounding"}
_RENAMED = {"Discovery": {"looks": "comparisons", "refused": "rejected"}}
#: Fields that a file stores with the fit alone.
_OF_FIT = {"Problem": ("measurements",)}
_BROKEN = (
    *(AttributeError, IndexError, KeyError, OSError, OverflowError, RecursionError, TypeError, ValueError),
    *(EOFError, MemoryError, RuntimeError, zipfile.BadZipFile, zlib.error),
    *(SyntaxError, tokenize.TokenError),  # of an array's header
)


@checked_arguments
def save(result: Fit | Discovery, path: str | os.PathLike[str]) -> None:
    """Write a fit or a discovery to a file that :func:`udd.load` reads.

    Parameters
    ----------
    result : Fit or Discovery
    path : path
        File to write (``.npz``). An existing file is replaced by the complete new file, or stays.

    Raises
    ------
    UddError
        It is no such result, or the file cannot be written.

    See Also
    --------
    udd.load : reads the file.

    Examples
    --------
    >>> import numpy as np, pathlib, tempfile, udd
    >>> t = np.arange(0, 20, 0.05)
    >>> theta = udd.simulate(udd.Pendulum(1.0, k0=0.02), t, [0.0, 0.5]).state[:, 1]
    >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    >>> fit = udd.fit(udd.Measurement(t, {"theta": theta + noise}), udd.Pendulum(1.0, k0=0.1), free=["k0"])
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "fit.npz"
    >>> udd.save(fit, path)
    >>> udd.load(path).parameters == fit.parameters
    True
    """
    if not isinstance(result, Fit | Discovery):
        raise UddError(f"a Fit or a Discovery can be saved, not {type(result).__name__}")
    writer = _Writer()
    writer.value(result)
    model = model_to_dict((result if isinstance(result, Fit) else result.baseline).model)
    tree = {"format": FORMAT, "model": model, "objects": writer.objects}
    text = np.frombuffer(json.dumps(tree, allow_nan=False).encode(), np.uint8)
    content = io.BytesIO()
    arrays = {f"a{k}": array for k, array in enumerate(writer.arrays)}
    np.savez_compressed(content, tree=text, **arrays)  # type: ignore[arg-type]  # it takes any names
    write_whole(path, content.getvalue())


@checked_arguments
def load(path: str | os.PathLike[str], *, limit: float = LARGEST) -> Fit | Discovery:
    """Read a fit or a discovery that :func:`udd.save` wrote; nothing in the file is run.

    Parameters
    ----------
    path : path
    limit : float, default 1e9
        Bytes of data that the file may unpack to; more is refused.

    Returns
    -------
    Fit or Discovery
        With the numbers that were saved, to the bit.

    Raises
    ------
    UddError
        There is no such file, it is not whole, not one of these, no regular file, or larger than `limit`.

    See Also
    --------
    udd.save : writes the file.

    Examples
    --------
    >>> import udd
    >>> fit = udd.load("fit.npz")  # doctest: +SKIP
    >>> print(fit.summary())  # doctest: +SKIP
    """
    memory = MemoryLimit(limit)
    try:
        content = read_regular(path, memory)
    except OSError as error:
        raise UddError(f"{path} cannot be read: {error.strerror}") from None
    except UddError as error:
        raise UddError(f"{path}: {error}") from None
    try:
        named = arrays_of(content, memory)
        text = named.pop("tree").tobytes()
        memory.take(NESTED * len(text))
        tree = json.loads(text)
        if tree["format"] != FORMAT:
            raise UddError(f"{path} is a result in another format: {str(tree['format'])[:80]!r}")
        arrays = [named[f"a{k}"] for k in range(len(named))]
        result = _read(tree, arrays)
    except UddError as error:
        raise error if str(path) in str(error) else UddError(f"{path}: {error}") from None
    except _BROKEN:
        raise UddError(f"{path} is not a whole file of udd.save") from None
    if not isinstance(result, Fit | Discovery):
        raise UddError(f"{path} holds neither a fit nor a discovery")
    return result


class _Writer:
    """Objects and arrays in the order of a file, each once."""

    def __init__(self) -> None:
        self.objects: list[Any] = []
        self.arrays: list[NDArray[Any]] = []
        self._places: dict[int, tuple[object, dict[str, int]]] = {}  # the object too: its id stays its own

    def value(self, value: Any) -> Any:
        """Return a value as a JSON value."""
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | str):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else {"float": str(value)}
        if isinstance(value, list):
            return [self.value(x) for x in value]
        if isinstance(value, FilmParameters):
            return {"film": [self.value(x) for x in value]}
        if isinstance(value, tuple):
            return {"tuple": [self.value(x) for x in value]}
        if isinstance(value, dict):
            return {"dict": [[self.value(k), self.value(x)] for k, x in value.items()]}
        if isinstance(value, _core.Linearised):
            return None  # computed again on demand
        if id(value) not in self._places:
            self._places[id(value)] = (value, self._new(value))
        return self._places[id(value)][1]

    def _new(self, value: Any) -> dict[str, int]:
        if isinstance(value, np.ndarray):
            if value.dtype.hasobject:
                raise ModelError("an array of Python objects cannot be saved")
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        self.objects.append(self._object(value))
        return {"object": len(self.objects) - 1}

    def _object(self, value: Any) -> dict[str, Any]:
        if isinstance(value, FormulaModel) and value.records:
            model_entries = {"equations": model_to_dict(value), "record": value.record}
            return {
                "driven": model_entries | {"records": self.value([dict(record) for record in value.records])}
            }
        if isinstance(value, Model):
            return {"model": model_to_dict(value)}
        if isinstance(value, Effect):
            return {"effect": effect_to_dict(value)}
        if isinstance(value, Slot):
            return {"slot": [value.name, value.momentum]}
        if isinstance(value, Coordinate):
            return {"coordinate": value.name}
        name = type(value).__name__
        if not is_dataclass(value) or _TYPES.get(name) is not type(value):
            raise ModelError(f"a result with a {name} in it cannot be saved")
        names = [attribute.name for attribute in fields(value) if attribute.name not in _OF_FIT.get(name, ())]
        entries = {attribute: self.value(getattr(value, attribute)) for attribute in names}
        # The doubts are those of the fit before its errors were widened: they cannot be computed again.
        signals = (
            {"doubts": self.value(value.doubts)} if isinstance(value, Fit) and "doubts" in vars(value) else {}
        )
        return {"type": name, "fields": entries | signals}


_hints = functools.cache(get_type_hints)


def checked(name: str, given: dict[str, Any]) -> Any:
    """Make an object of one of the types of a file, with its fields' types and shapes checked.

    Raises
    ------
    ValueError
        A field of another type, or shapes that do not go together.
    """
    hints = _hints(_TYPES[name])
    for field, value in given.items():
        if field in hints and not is_a(value, hints[field]):
            raise ValueError(field)
    result = _TYPES[name](**given)
    if not consistent(result, _SHAPES.get(name, "")) or (isinstance(result, Fit) and not _sound(result)):
        raise ValueError(name)
    return result


def driven(equations: Any, records: list[dict[str, InputSignal]], record: int) -> Model:
    """Return a model with the measured inputs.

    Raises
    ------
    ValueError
        A model that has none, or records that do not suit it.
    """
    model = model_from_dict(equations, fitted=True)
    if not isinstance(model, FormulaModel):
        raise ValueError(model.kind)
    return model.with_inputs(*records, record=record)


def _sound(fit: Fit) -> bool:
    """Return True if a fit's numbers belong to its free parameters, and its scatter is a number."""
    free = [one.name for one in fit.problem.free]
    return list(fit.parameters) == free == list(fit.errors) and fit.dof != 0


def _read(tree: Any, arrays: list[NDArray[Any]]) -> object:
    """Read the last object of a file."""
    model = model_from_dict(tree["model"], fitted=True)
    curves = {(slot.name, slot.momentum): slot for slot in slots(model)}
    objects: list[Any] = []
    numbers: dict[str, Callable[[Any], Any]] = {
        "float": float,
        "film": lambda x: FilmParameters(*map(value, x)),
        "tuple": lambda x: tuple(map(value, x)),
        "dict": lambda x: {value(k): value(v) for k, v in x},
        "array": arrays.__getitem__,
        "object": objects.__getitem__,
    }
    made: dict[str, Callable[[Any], Any]] = {
        "model": functools.partial(model_from_dict, fitted=True),
        "driven": lambda x: driven(x["equations"], value(x["records"]), x["record"]),
        "effect": effect_from_dict,
        "slot": lambda x: curves[x[0], x[1]],
        "coordinate": lambda x: coordinate(model, x),
    }

    def value(data: Any) -> Any:
        if isinstance(data, list):
            return [value(x) for x in data]
        if not isinstance(data, dict):
            return data
        ((kind, content),) = data.items()
        return numbers[kind](content)

    def new(data: Any) -> Any:
        if "type" not in data:
            ((kind, content),) = data.items()
            return made[kind](content)
        kind = _BEFORE.get(data["type"], data["type"])
        before = _RENAMED.get(kind, {})
        given = {before.get(name, name): value(x) for name, x in data["fields"].items()}
        doubts = given.pop("doubts", None)
        if kind == "Fit":
            given["problem"] = replace(given["problem"], measurements=given["measurements"])
        result = checked(kind, given)
        if isinstance(doubts, diagnostics.Diagnostics):
            vars(result)["doubts"] = doubts
        return result

    for data in tree["objects"]:
        objects.append(new(data))
    return objects[-1]
