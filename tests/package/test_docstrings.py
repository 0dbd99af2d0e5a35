"""Promises of the public docstrings (numpydoc); pytest's doctest runs their examples."""

from __future__ import annotations

import inspect

import pytest
from numpydoc.validate import validate

import udd

FUNCTIONS = [name for name in udd.__all__ if inspect.isfunction(getattr(udd, name))]
CLASSES = [name for name in udd.__all__ if inspect.isclass(getattr(udd, name))]

# numpydoc's own codes: a docstring at all, its sections in order, every parameter described, none that
# does not exist, what is returned, an example.
OF_ALL = {"GL07", "GL08", "PR02", "PR03", "PR10"}
OF_A_FUNCTION = OF_ALL | {"PR01", "RT01", "EX01"}


def faults(name: str, codes: set[str]) -> list[str]:
    return [f"{code}: {text}" for code, text in validate(f"udd.{name}")["errors"] if code in codes]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_is_documented(name: str) -> None:
    assert faults(name, OF_A_FUNCTION) == []


@pytest.mark.parametrize("name", CLASSES)
def test_a_public_class_is_documented(name: str) -> None:
    assert faults(name, OF_ALL) == []
