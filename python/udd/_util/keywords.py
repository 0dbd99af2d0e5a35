"""Keyword arguments: those that several functions share, and the names that they had before."""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any, ParamSpec, TypeVar, cast

from udd.errors import outside

P = ParamSpec("P")
R = TypeVar("R")
Options = TypeVar("Options", bound=Mapping[str, Any])


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function take its keyword arguments by their names of before, too, with a DeprecationWarning.

    Parameters
    ----------
    **names : str
        New name for each old name.
    """

    def decorator(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def wrapper(*given: P.args, **options: P.kwargs) -> R:
            for old in [name for name in options if name in names]:
                new = names[old]
                if new in options:
                    raise TypeError(f"{function.__name__}() got both {new!r} and {old!r}, its name of before")
                text = f"{function.__name__}({old}=...) is called {new}= now"
                warnings.warn(text, DeprecationWarning, stacklevel=outside())
                options[new] = options.pop(old)
            return function(*given, **options)

        return wrapper

    return decorator


def renamed_attribute(old: str, new: str) -> property:
    """Let an attribute be read by its name of before, too, with a DeprecationWarning."""

    def read(self: Any) -> Any:
        text = f"{type(self).__name__}.{old} is called {new} now"
        warnings.warn(text, DeprecationWarning, stacklevel=outside())
        return getattr(self, new)

    return property(read, doc=f"Old name of `{new}`, which works for one release more.")


def with_defaults(function: str, defaults: Options, given: Mapping[str, Any]) -> Options:
    """Return the keyword arguments that a function shares with others; defaults fill the rest.

    Raises
    ------
    TypeError
        One that it does not have.
    """
    for name in given:
        if name not in defaults:
            code = sys._getframe(1).f_code  # of the function
            parameter_names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            raise TypeError(
                f"{function}() got an unexpected keyword argument {name!r}; its arguments are "
                f"{', '.join([*parameter_names, *defaults])}"
            )
    return cast(Options, {**defaults, **given})
