"""Kinds of arguments: a public function names the argument whose value its annotation does not allow."""

from __future__ import annotations

import ast
import functools
import inspect
import operator
import os
import sys
import types
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from typing import Any, Literal, ParamSpec, TypeVar, Union, cast, get_args, get_origin, is_typeddict, overload

import numpy as np

from udd.errors import ModelError, UddError

P = ParamSpec("P")
R = TypeVar("R")

_UNCLEAR = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_LONGEST = 60  # characters of a refused value that a message repeats

_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "bool": "True or False",
    "str": "a text",
    "ArrayLike": "numbers",
    "Path": "a path",
    "PathLike": "a path",
    "Callable": "a function",
}
# Names of classes, which a module may import for its annotations alone. Other names that a module does not
# have, and protocols, are not checked.
_CLASSES = {
    "Axes": "Axes of Matplotlib",
    "BifurcationPoint": "a bifurcation point",
    "Branch": "a branch",
    "Discovery": "a discovery",
    "Equilibrium": "an equilibrium",
    "Fit": "a fit",
    "Measurement": "a measurement",
    "Model": "a model",
    "PeriodicOrbit": "a periodic orbit",
    "SweepSpec": "a SweepSpec",
    "Trajectory": "a trajectory",
}


@overload
def checked_arguments(function: Callable[P, R]) -> Callable[P, R]: ...
@overload
def checked_arguments(*, error: type[UddError]) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def checked_arguments(function: Callable[P, R] | None = None, *, error: type[UddError] = ModelError) -> Any:
    """Name the argument of a wrong kind if a call ends in an error that has no sentence of the package.

    The annotations say the kinds: a number, a model, a list of texts. The function runs first, and its own
    checks go first. An annotation that is not listed here accepts every value.

    Parameters
    ----------
    function : callable
        A function whose annotations are texts (``from __future__ import annotations``).
    error : type of UddError
        Class of the error. The default is :class:`udd.errors.ModelError`.

    Returns
    -------
    callable
        The function, which raises `error` with a sentence that names the argument.
    """
    if function is None:
        return functools.partial(checked_arguments, error=error)

    @functools.wraps(function)
    def wrapper(*given: P.args, **options: P.kwargs) -> R:
        try:
            return function(*given, **options)
        except UddError:
            raise
        except _UNCLEAR as cause:
            message = _wrong_argument(function, given, options)
            if message is None:
                raise
            raise error(message) from cause

    return wrapper


def _wrong_argument(
    function: Callable[..., object], given: tuple[object, ...], options: Mapping[str, object]
) -> str | None:
    """Return a sentence about the first argument of a wrong kind, or None."""
    signature = inspect.signature(function)
    try:
        values = signature.bind(*given, **options).arguments
    except TypeError:
        return None  # Python's own words name what is missing or not expected.
    for name, parameter in signature.parameters.items():
        is_single = parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        if is_single and name in values and isinstance(parameter.annotation, str):
            kind = _expanded(parameter.annotation, vars(sys.modules[function.__module__]))
            if not _is_of(kind, values[name]):
                return f"{name} must be {_in_words(kind)}, not {_shown(values[name])}"
    return None


class _ClassName(ast.Name):
    """The name of a class, with the class that a module means by it."""

    def __init__(self, meant: type) -> None:
        super().__init__(meant.__name__)
        self.meant = meant


def _expanded(annotation: str, names: Mapping[str, object]) -> ast.expr:
    """Parse an annotation, with what a module's names mean: unions and choices written out, and classes."""

    class Aliases(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            meant = names.get(node.id)
            if node.id == "ArrayLike" or meant is Any:
                return node
            if get_origin(meant) in (Literal, Union, types.UnionType):
                return ast.parse(_written(meant), mode="eval").body
            is_abstract = getattr(meant, "_is_protocol", False) or is_typeddict(meant)
            if isinstance(meant, type) and not is_abstract:
                return _ClassName(meant)
            return node

        def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
            node.slice = self.visit(node.slice)
            return node

        def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
            return node

    kind: ast.expr = Aliases().visit(ast.parse(annotation, mode="eval").body)
    return kind


def _written(meaning: Any) -> str:
    """Return a type as an annotation writes it, a union with bars."""
    if get_origin(meaning) in (Union, types.UnionType):
        return " | ".join(map(_written, get_args(meaning)))
    is_class = isinstance(meaning, type) and not get_args(meaning)
    return "None" if meaning is types.NoneType else meaning.__name__ if is_class else repr(meaning)


def _is_of(kind: ast.expr, value: object) -> bool:
    """Return True if a value is of the kind that an annotation names."""
    match kind:
        case ast.Constant(value=None):
            return value is None
        case _ClassName(meant=meant):
            return isinstance(value, meant)
        case ast.BinOp(left=left, right=right):
            return _is_of(left, value) or _is_of(right, value)
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return _is_of_name(name, value)
        case ast.Subscript(value=ast.Name(id=name) | ast.Attribute(attr=name), slice=inner):
            return _is_of_container(name, inner, value)
        case _:
            return True


def _is_of_name(name: str, value: object) -> bool:
    is_text, is_bool = isinstance(value, (str, bytes)), isinstance(value, (bool, np.bool_))
    if name == "float":
        return not is_text and not is_bool and _is_number(value)
    if name == "int":
        return not is_bool and _is_whole(value)
    if name == "bool":
        return is_bool or (_is_whole(value) and value in (0, 1))
    if name == "str":
        return isinstance(value, str)
    if name == "ArrayLike":
        return not is_text and _is_array(value)
    if name in _CLASSES:
        return any(base.__name__ == name for base in type(value).__mro__)
    return True


def _is_number(value: object) -> bool:
    """Return True if a value is a number that a float can hold."""
    try:
        float(cast(Any, value))
    except (TypeError, ValueError, OverflowError):
        return False
    return not isinstance(value, np.datetime64 | np.timedelta64) and np.ndim(cast(Any, value)) == 0


def _is_array(value: object) -> bool:
    """Return True if a value is numbers, or texts, of any shape."""
    try:
        return np.asarray(cast(Any, value)).dtype.kind in "biufcUS"
    except (TypeError, ValueError, OverflowError):
        return False


def _is_whole(value: object) -> bool:
    try:
        operator.index(cast(Any, value))
    except TypeError:
        return False
    return True


def _is_of_container(name: str, inner: ast.expr, value: object) -> bool:
    if name == "PathLike":
        return isinstance(value, os.PathLike)
    if name == "Callable":
        return callable(value)
    if name == "Literal":
        choices = ast.literal_eval(inner)
        return any(value is c or (isinstance(value, str) and value == c) for c in _as_tuple(choices))
    if name in ("Mapping", "dict"):
        key, of = cast(ast.Tuple, inner).elts
        return isinstance(value, Mapping) and all(_is_of(key, k) and _is_of(of, v) for k, v in value.items())
    if isinstance(value, np.ndarray) and name in ("Sequence", "Iterable", "Collection", "tuple"):
        if value.ndim == 0:
            return False
        value = value.tolist()
    if name in ("Sequence", "tuple"):
        if isinstance(value, (str, bytes)) or not isinstance(value, Sequence):
            return False
        of_each = inner.elts if isinstance(inner, ast.Tuple) else [inner] * len(value)
        if of_each and isinstance(of_each[-1], ast.Constant) and of_each[-1].value is Ellipsis:
            of_each = [of_each[0]] * len(value)
        return len(of_each) == len(value) and all(map(_is_of, of_each, value))
    if name in ("Iterable", "Collection"):
        if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
            return False
        return not isinstance(value, (Sequence, Set)) or all(_is_of(inner, each) for each in value)
    return True


def _as_tuple(value: object) -> tuple[object, ...]:
    return value if isinstance(value, tuple) else (value,)


def _in_words(kind: ast.expr) -> str:
    """Return an annotation in words."""
    match kind:
        case ast.Constant(value=None):
            return "None"
        case ast.BinOp(left=left, right=ast.Constant(value=None)):
            return _in_words(left)
        case ast.BinOp(left=left, right=right):
            return f"{_in_words(left)} or {_in_words(right)}"
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return _WORDS.get(name) or _CLASSES.get(name) or name
        case ast.Subscript(value=ast.Name(id="Literal") | ast.Attribute(attr="Literal"), slice=inner):
            return " or ".join(map(repr, _as_tuple(ast.literal_eval(inner))))
        case ast.Subscript(value=ast.Name(id="tuple"), slice=ast.Tuple(elts=[*each])) if _is_pair(each):
            return f"{len(each)} values ({', '.join(map(_in_words, each))})"
        case ast.Subscript(value=ast.Name(id="Mapping" | "dict"), slice=ast.Tuple(elts=[_, of])):
            return f"a mapping of names to {_in_words(of)}"
        case ast.Subscript(value=ast.Name(id="Sequence" | "Iterable" | "Collection" | "tuple"), slice=inner):
            return f"a list of {_plural(inner.elts[0] if isinstance(inner, ast.Tuple) else inner)}"
        case ast.Subscript(value=ast.Name(id=name) | ast.Attribute(attr=name)):
            return _WORDS.get(name, name)
        case _:
            return ast.unparse(kind)


def _plural(kind: ast.expr) -> str:
    """Return an annotation in words, for several values."""
    words = [word.removeprefix("a ").removeprefix("an ") for word in _in_words(kind).split(" or ")]
    return " or ".join(f"{word}s" if word[0].islower() else word for word in words)


def _is_pair(each: Sequence[ast.expr]) -> bool:
    """Return True if a tuple's annotation names each of its values."""
    return not any(isinstance(of, ast.Constant) and of.value is Ellipsis for of in each)


def _shown(value: object) -> str:
    """Return a value as a message shows it."""
    try:
        text = " ".join(repr(value).split())
    except Exception:
        text = type(value).__name__
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
