"""Physical effects that the plain models lack.

Each effect of the library has a constructor here, named after it: ``relaxation(b=5.0)``,
``quadratic_drag(c=1e-4)``, ... They are generated from the core's library: one file for each effect states
its formula, its parameters with units and ranges, and the equation that it enters. :func:`library` lists
them.

Examples
--------
>>> from udd import Disk, effects
>>> effects.relaxation(b=5.0)
relaxation(b=5.0, momentum='constraint')
>>> model = Disk(0.039, effects=[effects.relaxation(b=5.0), effects.quadratic_drag(c=1e-4)])
>>> model.parameters["relaxation.b"]
5.0

For effects outside the library use a :func:`formula`, a :func:`curve`, or a :func:`surface` over two
coordinates:

>>> effects.formula("torque", "c*sin(2*beta)", c=0.01, name="warp").equation
'torque = c*sin(2*beta)'
"""

from __future__ import annotations

import inspect
from collections.abc import Callable

from .spec import Effect, Parameter, Spec, _specs, library
from .user_defined import curve, formula, surface

__all__ = ["Effect", "Parameter", "Spec", "curve", "formula", "library", "surface"]


def _constructor(spec: Spec) -> Callable[..., Effect]:
    """Make the constructor of an effect, with its signature and documentation."""
    kind = inspect.Parameter.KEYWORD_ONLY
    arguments = [inspect.Parameter(p.name, kind, default=p.default) for p in spec.parameters]
    if spec.momenta:
        arguments.append(inspect.Parameter("momentum", kind, default=spec.momenta[0]))
    if spec.treatments:
        arguments.append(inspect.Parameter("treatment", kind, default=spec.treatments[0]))

    def make(*, momentum: str | None = None, treatment: str | None = None, **values: float) -> Effect:
        return spec.make(momentum=momentum, treatment=treatment, **values)

    lines = [f"Make the effect {spec.title}: ``{spec.equation}``.", ""]
    lines += [f"{spec.meaning[0].upper()}{spec.meaning[1:]}.", "", "Parameters", "----------"]
    for p in spec.parameters:
        low, high = p.range
        lines += [f"{p.name} : float", f"    {p.role.capitalize()} [{p.unit or '1'}], {low:g} to {high:g}."]
    if spec.momenta:
        lines += [
            f"momentum : {{{', '.join(map(repr, spec.momenta))}}}",
            "    Way to enter the angular momentum.",
        ]
    if spec.treatments:
        lines += [
            f"treatment : {{{', '.join(map(repr, spec.treatments))}}}",
            "    Treatment of the friction at rest.",
        ]
    lines += ["", "Returns", "-------", "Effect", "    With these values."]
    lines += [
        "",
        "See Also",
        "--------",
        "udd.effects.library : all effects.",
        "udd.discover : effects that a model lacks.",
    ]
    make.__name__ = make.__qualname__ = spec.name
    make.__doc__ = "\n".join(lines)
    make.__signature__ = inspect.Signature(arguments)  # type: ignore[attr-defined]
    return make


def __getattr__(name: str) -> Callable[..., Effect]:
    if name in _specs():
        made = globals()[name] = _constructor(_specs()[name])
        return made
    raise AttributeError(f"no effect is called {name!r}; choose one of {', '.join(_specs())}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_specs()])
