"""Formulas as users hand them over: text, numbers, or SymPy's expressions."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any, TypeAlias

from udd.errors import ModelError

from .validation import number

if TYPE_CHECKING:
    import sympy

#: A formula: text, a number, or an expression of SymPy.
Expression: TypeAlias = "str | float | sympy.Expr"


def text_of(what: str, expression: object) -> str:
    """Return the formula as text that the core reads.

    Raises
    ------
    ModelError
        It is no formula, or holds something of SymPy that has no place in one; `what` names it.
    """
    if isinstance(expression, str):
        return expression
    if isinstance(expression, (int, float)) and not isinstance(expression, bool):
        return repr(number(what, expression))
    if type(expression).__module__.partition(".")[0] == "sympy" or hasattr(expression, "free_symbols"):
        return _from_sympy(what, expression)
    raise ModelError(f"{what} must be text or a SymPy expression, not {expression!r}")


def _from_sympy(what: str, expression: Any) -> str:
    """Return SymPy's text, with numbers in full and names as the core has them."""
    from sympy import Derivative, Expr, Ge, Gt, Le, Lt, true
    from sympy.core.function import AppliedUndef
    from sympy.printing.str import StrPrinter

    if not isinstance(expression, Expr):
        raise ModelError(f"{what} must be a formula, not {expression!r}")
    if expression.has(Derivative):
        raise ModelError(f"{what} contains a derivative: solve for the rates first, not {expression}")

    class Printer(StrPrinter):  # type: ignore[misc]
        def _print_Float(self, number: Any) -> str:
            return repr(float(number))

        def _print_Abs(self, call: Any) -> str:
            return f"abs({self._print(call.args[0])})"

        def _print_Min(self, call: Any) -> str:
            return str(reduce(lambda a, b: f"min({a}, {b})", map(self._print, call.args)))

        def _print_Max(self, call: Any) -> str:
            return str(reduce(lambda a, b: f"max({a}, {b})", map(self._print, call.args)))

        def _print_Piecewise(self, call: Any) -> str:
            *cases, last = call.args
            compared = all(isinstance(case.cond, (Gt, Ge, Lt, Le)) for case in cases)
            if last.cond != true or not compared:
                raise ModelError(
                    f"{what}: a Piecewise needs one inequality for each case, True for the last, not {call}"
                )
            text = self._print(last.expr)
            for case in reversed(cases):
                text = f"where({self._print(case.cond)}, {self._print(case.expr)}, {text})"
            return str(text)

        def _print_Exp1(self, _number: Any) -> str:
            return "exp(1)"

        def _print_Function(self, call: Any) -> str:
            # theta(t), as in SymPy's mechanics, is the state theta.
            if isinstance(call, AppliedUndef):
                return str(call.func)
            return str(super()._print_Function(call))

    return str(Printer().doprint(expression))
