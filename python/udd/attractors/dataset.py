"""Attributes of the arrays of a result: names, units and options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from udd._util.versions import version_of
from udd.models import Model

from .section_runs import ALL_OUTCOMES, SectionRunner

Variables: TypeAlias = dict[str, tuple[Any, ...]]
"""Arrays as xarray takes them: dimensions, values, attributes."""


def of_flags(words: str, names: Sequence[str]) -> dict[str, Any]:
    """Return the attributes of an array of places in `names`, by the CF conventions."""
    meanings = " ".join(name.replace(" ", "_") for name in names)
    return {"long_name": words, "flag_values": list(range(len(names))), "flag_meanings": meanings}


def of_outcomes() -> dict[str, Any]:
    """Return the attributes of the array ``outcome``."""
    return of_flags("how it ended", ALL_OUTCOMES)


def of_state(model: Model, name: str, words: str) -> dict[str, Any]:
    """Return the attributes of a component of the state."""
    unit = dict(zip(model.state_names, model.state_units, strict=True))[name]
    return {"long_name": f"{name} {words}", "units": unit or "1"}


def of_parameter(model: Model, name: str) -> dict[str, Any]:
    """Return the attributes of a parameter."""
    return {"long_name": f"parameter {name}", "units": model.units[name] or "1"}


def time_unit(model: Model) -> str:
    """Return the unit of the model's time."""
    return "1" if all(not unit for unit in model.state_units) else "s"


def of_result(runner: SectionRunner, what: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes of the dataset: the model, the options, the version."""
    return {
        "title": what,
        "model": repr(runner.model),
        "section": ", ".join(runner.section),
        "direction": ", ".join({1: "up", -1: "down", 0: "both"}[way] for way in runner.direction),
        "rtol": runner.rtol,
        "atol": runner.atol,
        **options,
        "udd_version": version_of("udd"),
    }
