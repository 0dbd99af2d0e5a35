"""The specification of a sweep: all that decides its numbers, as a value."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from udd._util.arguments import checked_arguments
from udd._util.input_files import LARGEST
from udd._util.tables import parsed, read, table
from udd._util.validation import array, number, whole
from udd.errors import ModelError, UddError
from udd.models import Model, require_model
from udd.models.parameter_batch import default_state
from udd.models.serialization import model_from_dict, model_to_dict
from udd.simulation.trajectory import initial_state

from .quantities import QUANTITIES

RESULT_FORMAT = 3
"""To be raised with every change that gives other numbers or other arrays for the same spec."""

_LONGEST = 10**8  # values of an axis
_KEYS = ("quantity", "model", "over", "state0", "options", "chunk")


@dataclass(frozen=True, eq=False, repr=False)
class SweepSpec:
    """Specification of a sweep: a quantity, a model, and the values to compute it at.

    Specs are equal where their hashes are.

    Parameters
    ----------
    quantity : {"lyapunov", "spectrum", "final_state", "outcome"}
        The quantity that is computed for every trajectory.
    model : Model
        The model; what `over` names is varied in it.
    over : mapping of str to array_like
        One to three axes: parameters of the model (an effect's as ``"effect.name"``) or components of the
        initial state, with their values.
    state0 : array_like, shape (dim,), optional
        The initial state, for the components that are not varied; by default that of :func:`udd.lyapunov`.
    options : mapping of str to float, optional
        "lyapunov" and "spectrum": `t`, `tol`, `transient`, `rtol`, `atol` and `max_step` as in
        :func:`udd.lyapunov`. "final_state" and "outcome": the length `t` of the runs, `rtol`, `atol` and
        `max_step`; they are those of :func:`udd.ensemble`.
    chunk : int
        How many trajectories are computed and written at once, at most.

    Raises
    ------
    ModelError
        An unknown name, or a value that cannot be used.

    See Also
    --------
    udd.sweep : computes it.

    Examples
    --------
    >>> import udd
    >>> spec = udd.SweepSpec("lyapunov", udd.DLE(1.0), {"w": [0.5, 1.0, 2.0]}, options={"tol": 0.01})
    >>> spec.shape
    (3,)
    >>> udd.SweepSpec.from_json(spec.to_json()) == spec
    True
    """

    quantity: str
    model: Model
    over: Mapping[str, ArrayLike]
    state0: ArrayLike | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    chunk: int = 1024

    def __post_init__(self) -> None:
        if not isinstance(self.quantity, str) or self.quantity not in QUANTITIES:
            raise ModelError(f"quantity must be one of {', '.join(QUANTITIES)}, not {self.quantity!r}")
        require_model(self.model)
        model_from_dict(model_to_dict(self.model))  # as the store's text is read back
        if not isinstance(self.over, Mapping) or not 1 <= len(self.over) <= 3:
            raise ModelError("over must name one to three axes with their values")
        over = {name: _axis(self.model, name, values) for name, values in self.over.items()}
        state = initial_state(self.model, default_state(self.model) if self.state0 is None else self.state0)
        options = QUANTITIES[self.quantity].options(self.model, table("options", self.options))
        checked = {"over": over, "state0": state, "options": options, "chunk": whole("chunk", self.chunk, 1)}
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def axes(self) -> dict[str, NDArray[np.float64]]:
        """The values along each axis."""
        return {name: np.asarray(values) for name, values in self.over.items()}

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of values along each axis."""
        return tuple(len(values) for values in self.axes.values())

    def to_dict(self) -> dict[str, Any]:
        """Return the specification as plain data; equally spaced values as their ends and number.

        Returns
        -------
        dict
            As :meth:`from_dict` takes it.
        """
        return {
            "quantity": self.quantity,
            "model": model_to_dict(self.model),
            "over": [{"name": name, **_values_to_dict(values)} for name, values in self.axes.items()],
            "state0": np.asarray(self.state0).tolist(),
            "options": dict(self.options),
            "chunk": self.chunk,
        }

    def to_json(self) -> str:
        """Return the specification as JSON; equal specifications give equal texts.

        Returns
        -------
        str
            As :meth:`from_json` takes it.
        """
        return json.dumps(self.to_dict(), sort_keys=True, separators=(",", ":"), allow_nan=False)

    @classmethod
    @checked_arguments
    def from_dict(cls, data: Mapping[str, Any]) -> SweepSpec:
        """Make the specification from plain data.

        Parameters
        ----------
        data : mapping
            As :meth:`to_dict` returns it; `over` may also be a table of names and values.

        Returns
        -------
        SweepSpec
            Checked.

        Raises
        ------
        ModelError
            Something is missing, unknown or unusable.
        """
        given = table("a sweep", data, _KEYS, needed=_KEYS[:3])
        over = given.pop("over")
        if isinstance(over, list) and all(
            isinstance(axis, dict) and isinstance(axis.get("name"), str) for axis in over
        ):
            if len({axis["name"] for axis in over}) < len(over):
                raise ModelError("over names an axis twice")
            over = {axis["name"]: {k: v for k, v in axis.items() if k != "name"} for axis in over}
        axes = {name: _values_from(f"over.{name}", values) for name, values in table("over", over).items()}
        return cls(model=model_from_dict(given.pop("model")), over=axes, **given)

    @classmethod
    @checked_arguments
    def from_json(cls, text: str) -> SweepSpec:
        """Make the specification from JSON.

        Parameters
        ----------
        text : str
            As :meth:`to_json` returns it.

        Returns
        -------
        SweepSpec
            Checked.

        Raises
        ------
        ModelError
            It is not JSON, or not of a sweep.
        """
        return cls.from_dict(parsed("the sweep", text))

    @classmethod
    @checked_arguments
    def read(cls, path: str | os.PathLike[str], *, limit: float = LARGEST) -> SweepSpec:
        """Read the specification from a file: TOML if its name ends so, otherwise JSON.

        Parameters
        ----------
        path : path
            The file.
        limit : float, default 1e9
            Bytes of memory that it may take: a hundred, and a thousand in TOML, for each byte of the file.

        Returns
        -------
        SweepSpec
            Checked.

        Raises
        ------
        UddError
            The file cannot be read or understood, or takes more than `limit`; the sentence names it.
        """
        data = read(Path(path), toml=Path(path).suffix == ".toml", limit=limit)
        try:
            return cls.from_dict(data)
        except UddError as error:
            raise UddError(f"{path}: {error}") from None

    @cached_property
    def sha256(self) -> str:
        """The hash of the spec and of the format of results."""
        # Stores that were begun when a formula model's kind was written "own" go on.
        said = self.to_json().replace('"kind":"formula"', '"kind":"own"')
        return hashlib.sha256(f"udd sweep {RESULT_FORMAT} {said}".encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SweepSpec) and self.sha256 == other.sha256

    def __hash__(self) -> int:
        return hash(self.sha256)

    def __repr__(self) -> str:
        axes = ", ".join(
            f"{name}: {len(values)} from {values[0]:g} to {values[-1]:g}"
            for name, values in self.axes.items()
        )
        return f"<SweepSpec: {self.quantity} of {self.model!r} over {axes}>"


def _axis(model: Model, name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return the checked values of an axis, as an immutable copy."""
    if name not in (*model.parameters, *model.state_names):
        names = ", ".join((*model.parameters, *model.state_names))
        raise ModelError(f"nothing of this model is called {name!r}; there are {names}")
    axis = array(f"the values of {name}", values).copy()
    if axis.ndim != 1 or not len(axis):
        raise ModelError(f"the values of {name} must be a list of at least one number")
    if name in model.parameters:
        effect, _, parameter = name.rpartition(".")
        for value in (float(axis.min()), float(axis.max())):  # the ranges have no gaps
            if effect:
                spec = next(e.spec for e in model.effects if e.name == effect)
                next(p for p in spec.parameters if p.name == parameter).check(effect, value, strict=False)
            else:
                model.replace(**{name: value})
    axis.flags.writeable = False
    return axis


def _values_to_dict(values: NDArray[np.float64]) -> dict[str, Any]:
    first, last, n = float(values[0]), float(values[-1]), len(values)
    if n > 2 and (np.linspace(first, last, n).view(np.uint64) == values.view(np.uint64)).all():  # to the bit
        return {"from": first, "to": last, "n": n}
    return {"values": values.tolist()}


def _values_from(where: str, data: Any) -> ArrayLike:
    if not isinstance(data, Mapping):
        return np.atleast_1d(array(where, data))
    if "values" in data:
        return array(f"{where}.values", table(where, data, ["values"])["values"])
    if data.keys() != {"from", "to", "n"}:
        raise ModelError(f"{where} must be a list, or from, to and n, not {', '.join(map(str, data))}")
    if whole(f"{where}.n", data["n"], 1) > _LONGEST:
        raise ModelError(f"{where}.n must be at most {_LONGEST}, not {data['n']}")
    return np.linspace(number(f"{where}.from", data["from"]), number(f"{where}.to", data["to"]), data["n"])
