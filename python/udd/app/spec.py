"""Models and states from the page's JSON, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from udd._util.tables import parsed, table
from udd.errors import ModelError
from udd.models import Model
from udd.models.serialization import model_from_dict
from udd.simulation.trajectory import initial_state

from .page_models import PAGE_MODELS


@dataclass(frozen=True)
class Start:
    """A model and the state that a run begins at."""

    model: Model
    state: tuple[float, ...]


def start_of(data: Any) -> Start:
    """Read a model and a state from the page's JSON.

    Raises
    ------
    ModelError
        Naming what cannot be used.
    """
    if not isinstance(data, dict):
        raise ModelError("a run must be given as a table with model and state")
    model = model_of(data.get("model"))
    state = initial_state(model, data.get("state"))  # type: ignore[arg-type]  # checked there
    return Start(model, tuple(state.tolist()))


def model_of(data: Any) -> Model:
    """Make a disk or the DLE from JSON, with effects of the library."""
    if isinstance(data, dict) and data.get("kind") not in tuple(PAGE_MODELS):  # also what is not hashable
        raise ModelError(f"the page shows a disk or the dle, not {data.get('kind')!r}")
    return model_from_dict(data)


def key_of(start: Start) -> str:
    """Return a text that is equal for equal runs."""
    return f"{start.model!r} {start.state!r}"


def drive_of(model: Model) -> str:
    """Return the name of the drive among the parameters."""
    drive = model.profile.dynamics.drive
    assert drive is not None  # of the models that the page shows
    return drive


def message_of(text: str) -> dict[str, Any]:
    """Read a message from the page.

    Raises
    ------
    ModelError
        It is no JSON object.
    """
    return table("a message", parsed("a message", text))


def whole(data: dict[str, Any], name: str, least: int, most: int) -> int:
    """Read a whole number of a message."""
    value = data.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise ModelError(f"{name} must be a whole number from {least} to {most}, not {value!r}")
    return value
