"""Structural checks of objects that a file describes: the types of fields, and the shapes of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np


def is_a(value: object, hint: Any) -> bool:
    """Return True if a value has the type of a field's annotation, elements included."""
    kind, inner = get_origin(hint), get_args(hint)
    if hint is Any:
        return True
    if kind in (Union, UnionType):
        return any(is_a(value, item) for item in inner)
    if kind is Literal:
        return value in inner
    if kind is np.ndarray:
        return isinstance(value, np.ndarray) and _holds(value.dtype, get_args(inner[1])[0])
    if kind is tuple and inner[-1] is not Ellipsis:
        return isinstance(value, tuple) and len(value) == len(inner) and all(map(is_a, value, inner))
    if kind in (list, tuple):
        return isinstance(value, kind) and all(is_a(item, inner[0]) for item in value)
    if kind in (dict, Mapping):
        return isinstance(value, Mapping) and all(
            is_a(k, inner[0]) and is_a(x, inner[1]) for k, x in value.items()
        )
    if hint in (float, int):  # a whole number is a float, too; a bool is neither
        whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
        return whole or (hint is float and isinstance(value, float))
    return isinstance(value, NoneType if hint is None else hint)


def _holds(dtype: np.dtype[Any], scalar: Any) -> bool:
    return scalar is Any or np.issubdtype(dtype, scalar)


def consistent(value: object, shapes: str) -> bool:
    """Return True if arrays and lists have shapes that fit together.

    Parameters
    ----------
    value : object
    shapes : str
        ``"t:n seen:nm"`` says that `t` and the rows of `seen` are as many; a dot leads to a part's part.
    """
    sizes: dict[str, int] = {}
    for one in shapes.split():
        path, letters = one.split(":")
        part: Any = value
        for name in path.split("."):
            part = getattr(part, name)
        if part is None:
            continue
        shape = part.shape if isinstance(part, np.ndarray) else (len(part),)
        if len(shape) != len(letters):
            return False
        if any(sizes.setdefault(k, size) != size for k, size in zip(letters, shape, strict=True)):
            return False
    return True
