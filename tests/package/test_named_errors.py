"""Errors and warnings that docstrings name can be caught by that name: as ``udd.NAME``."""

from __future__ import annotations

import builtins
import re
from pathlib import Path

import pytest

import udd

#: Caught within the package: no user meets them.
INTERNAL = {"ChunksLost", "CorrectorFailed", "Refused", "SpentError", "TooLarge"}
SOURCES = sorted(Path(udd.__file__).parent.rglob("*.py"))
SECTION = re.compile(
    r"^( *)(Raises|Warns)\n\1-{5,6}\n((?:\1.*\n|\n)+?)(?=\1[A-Z]\w+(?: \w+)*\n\1-{3,}\n|\1\"\"\")", re.M
)


def named() -> dict[str, str]:
    """Map the errors and warnings in all sections Raises and Warns to their first place."""
    result: dict[str, str] = {}
    for path in SOURCES:
        for section in SECTION.finditer(path.read_text(encoding="utf-8")):
            indent = section[1]
            for name in re.findall(rf"^{indent}([A-Z]\w+(?:, [A-Z]\w+)*)$", section[3], re.M):
                for item in name.split(", "):
                    result.setdefault(item, path.name)
    return result


def test_the_sections_are_found():
    assert {"FitError", "ModelError", "MeasurementError", "IntegrationError", "TrackError"} <= set(named())


@pytest.mark.parametrize("name", sorted(set(named()) - INTERNAL))
def test_an_error_that_a_docstring_names_is_reachable(name: str):
    error = getattr(udd, name, None) or getattr(builtins, name, None)
    assert isinstance(error, type) and issubclass(error, BaseException), f"{name}, named in {named()[name]}"


def test_errors_of_bad_input_are_all_of_one_family():
    for name in ("FitError", "IntegrationError", "MeasurementError", "ModelError", "TrackError"):
        assert issubclass(getattr(udd, name), udd.UddError) and issubclass(udd.UddError, ValueError)
        assert name in udd.__all__
