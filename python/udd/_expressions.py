"""Formulas as users hand them over: text, numbers, or SymPy's expressions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from udd.errors import ModelError

if TYPE_CHECKING:
    import sympy

#: A formula: text, a number, or an expression of SymPy.
Expression: TypeAlias = "str | float | sympy.Expr"


def text_of(what: str, expression: object) -> str:
    """The formula as text that the core reads.

    Raises
    ------
    ModelError
        It is no formula, or holds something of SymPy that has no place in one; `what` names it.
    """
    if isinstance(expression, str):
        return expression
    if isinstance(expression, (int, float)) and not isinstance(expression, bool):
        return repr(float(expression))
    if type(expression).__module__.partition(".")[0] == "sympy" or hasattr(expression, "free_symbols"):
        return _from_sympy(what, expression)
    raise ModelError(f"{what} must be text or a SymPy expression, not {expression!r}")


def _from_sympy(what: str, expression: Any) -> str:
    """As SymPy prints it, but for numbers in full and names as the core has them."""
    from sympy import Derivative, Expr
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

        def _print_Exp1(self, _number: Any) -> str:
            return "exp(1)"

        def _print_Function(self, call: Any) -> str:
            # theta(t), as in SymPy's mechanics, is the state theta.
            if isinstance(call, AppliedUndef):
                return str(call.func)
            return str(super()._print_Function(call))

    return str(Printer().doprint(expression))
