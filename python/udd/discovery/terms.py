"""The terms that a user's own model may lack, made of its states."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable

from udd import effects
from udd._expressions import Expression, text_of
from udd.errors import ModelError
from udd.own_models import OwnModel

from .candidates import Candidate

_DEGREE = 3
_FEW = 4  # states of which all products up to that degree are tried; of more, up to the second


def terms(model: OwnModel) -> list[Candidate]:
    """Every term that is tried in the equations of a user's own model.

    Of the states that are no angles: a constant, all products up to the third degree, and each times its own
    size; of each angle and of every two angles' difference sine and cosine, also times each other state; of
    every angle the rate, where that is no state itself. An equation that only says that one state is the rate
    of another gets none.
    """
    written = _of_states(model)
    rates = {name: model.equations[name] for name in model.angles}
    rates = {name: text for name, text in rates.items() if not _kinematic(model, name)}
    result = []
    for state in model.state_names:
        if _kinematic(model, state):
            continue
        own = written + [(f"({text})", f"rate_of_{name}") for name, text in rates.items() if name != state]
        result += [_candidate(model, state, text, name) for text, name in own]
    return result


def given_terms(model: OwnModel, given: Iterable[tuple[str, Expression]]) -> list[Candidate]:
    """The terms that a user asks for, each an equation's state and a formula.

    Raises
    ------
    ModelError
        One that the model cannot have.
    """
    result = []
    for one in given:
        if isinstance(one, str) or not isinstance(one, (tuple, list)) or len(one) != 2:
            raise ModelError(
                f"a candidate is an equation's state and a term, as in ('v', 'abs(v)*v'), not {one!r}"
            )
        state, term = str(one[0]).removesuffix("'"), text_of("a candidate", one[1])
        if state not in model.state_names:
            raise ModelError(
                f"there is no equation of {state!r} for the candidate {term!r}; there are "
                f"{', '.join(model.state_names)}"
            )
        candidate = _candidate(model, state, term, _name(term))
        candidate.added_to(model)  # which parses it
        result.append(candidate)
    return result


def _kinematic(model: OwnModel, state: str) -> bool:
    """Whether an equation only says that one state is the rate of another."""
    return model.equations[state].strip() in model.state_names


def _candidate(model: OwnModel, state: str, text: str, name: str) -> Candidate:
    taken = {*model.state_names, *dict(model.values)}
    amplitude = next(c for c in ("c", "a", "amplitude", *(f"c{k}" for k in range(99))) if c not in taken)
    term = amplitude if text == "1" else f"{amplitude}*{text}"
    title = f"{text} in {state}'"
    effect = effects.formula(f"{state}'", term, name=f"{name}_in_{state}", title=title, **{amplitude: 0.0})
    return Candidate(effect, title)


def _of_states(model: OwnModel) -> list[tuple[str, str]]:
    """Terms and what their parameters are called after."""
    plain = [name for name in model.state_names if name not in model.angles]
    degree = _DEGREE if len(plain) <= _FEW else 2
    powers = [p for d in range(degree + 1) for p in itertools.combinations_with_replacement(plain, d)]
    result = [_product(p) for p in powers] + [f"abs({name})*{name}" for name in plain]
    turning = list(model.angles) + [f"{a} - {b}" for a, b in itertools.combinations(model.angles, 2)]
    for angle in turning:
        for wave in ("sin", "cos"):
            result += [f"{wave}({angle})"] + [f"{name}*{wave}({angle})" for name in plain]
        result.append(f"sin(2*({angle}))" if " " in angle else f"sin(2*{angle})")
    return [(text, _name(text)) for text in result]


def _product(names: tuple[str, ...]) -> str:
    counted = {name: names.count(name) for name in names}
    return "*".join(name if k == 1 else f"{name}^{k}" for name, k in counted.items()) or "1"


def _name(text: str) -> str:
    """A word that says what a term is."""
    if text == "1":
        return "constant"
    said = text.replace("^", "").replace(" - ", "_less_").replace("-", "_less_").replace("/", "_over_")
    word = re.sub(r"\W+", "_", said).strip("_")
    return word if word.isidentifier() else f"term_{word}"
