"""Terms that a user's own model may lack, made of its states."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd import effects
from udd._util.expressions import Expression, text_of
from udd.effects.user_defined import along_of
from udd.errors import ModelError
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .candidate import Candidate
from .coordinates import slots
from .written_laws import EITHER, NEGATIVE, POSITIVE, Range, Shape, laws, unused_names, word_for

_DEGREE = 3
#: Maximum of states and inputs for products of the third degree: 4 have 35 for each equation, 12 would have
#: 455.
_FEW = 4
_MOST = 200  # maximum of terms in an equation; above it sines and cosines are not multiplied by states
#: Widths of the smoothed sign of dry friction, in units of the speed's root mean square. The narrowest keeps
#: a body at rest for thousands of swings. For a driven machine that rests now and then, read to 1e-3 of its
#: motion, a width ten times larger leaves an error that looks like a second friction.
_WIDTHS = (0.3, 0.03, 0.002, 0.0002)
#: The same for terms with a threshold, in units of the argument's root mean square.
_BOUNDS = (0.7, 0.2)
_SWINGS = 0.3  # minimum ratio of the argument's standard deviation to its root mean square, for that


def terms(model: FormulaModel) -> list[Candidate]:
    """List every term that is tried in the equations of a user's own model, except dry friction.

    - For states that are not angles and for measured inputs: a constant, all products up to the third degree,
      and each times its absolute value. With more than four of them products go up to the second degree, and
      the cube of each is added.
    - For each angle and the difference of every two angles: sine and cosine, also times each of the others
      unless an equation then had more than 200 terms. If the rate of an angle is no state, it is added.

    Equations in which one state is the rate of another get no terms. In a mechanical model forces that
    machines have (inputs, springs, drags, gravity) are preferred by a prior penalty on the others. With a
    mass matrix all terms are forces along its coordinates; those that machines have also act between two
    coordinates.
    """
    plain = [(text, word_for(text), text) for text in _of_states(model)]
    rates = {name: model.equations[name] for name in model.angles}
    rates = {name: text for name, text in rates.items() if name not in model.kinematic}
    result = [force for along in _ways(model) for force in _machines(model, along)]
    for slot in slots(model):
        state, along = slot.equation, along_of(slot.name)
        usual = _own_forces(model, along) if along else _forces(model, state)
        moving = [(f"({text})", f"rate_of_{k}", f"{k}'") for k, text in rates.items() if k != state]
        for entry in plain + moving:
            machine = not usual or entry[2] in usual or entry in moving
            if not (along and entry[2] in usual):  # listed already
                result.append(replace(_candidate(model, slot.name, *entry), usual=machine))
    return result


def delays(model: FormulaModel) -> list[Candidate]:
    """List the delay of every measured input without one; a negative delay is one of the observation."""
    late = model.late
    return [
        candidate
        for name in model.inputs
        if name not in late
        for candidate in laws(model, f"delay({name})", "{tau}", f"delay of {name}", {"tau": EITHER})
    ]


def _ways(model: FormulaModel) -> list[str]:
    """List the lines of force of a model with a mass matrix: its coordinates, and pairs of the same kind."""
    pairs = itertools.combinations(model.speeds, 2)
    between = [f"{b} - {a}" for a, b in pairs if (a in model.angles) == (b in model.angles)]
    return [*model.speeds, *between] if model.mass else []


def _along(model: FormulaModel, along: str) -> tuple[str, str]:
    """Return the rate along a line of force, and its name for a reader."""
    first, *other = along.split(" - ")
    if not other:
        return model.speeds[first], f"along {first}"
    return f"({model.speeds[first]} - {model.speeds[other[0]]})", f"between {other[0]} and {first}"


def _own_forces(model: FormulaModel, x: str) -> set[str]:
    """Return the terms of :func:`_machines` along a coordinate, as :func:`_of_states` writes them."""
    v = model.speeds[x]
    position_terms = {f"sin({x})", f"cos({x})"} if x in model.angles else {x, f"{x}^3"}
    return {"1", v, f"abs({v})*{v}", f"{v}^3", *position_terms}


def _machines(model: FormulaModel, along: str) -> list[Candidate]:
    """List forces that machines have, except dry friction, along a coordinate or between two."""
    v, where = _along(model, along)
    listed = [
        ("viscous friction", f"-{{c}}*{v}", POSITIVE),
        ("quadratic drag", f"-{{c}}*abs({v.strip('()')})*{v}", POSITIVE),
        ("cubic drag", f"-{{c}}*{v}^3", POSITIVE),
    ]
    if along.split(" - ")[0] in model.angles:
        listed += [(f"{wave}({along})", f"{{c}}*{wave}({along})", EITHER) for wave in ("sin", "cos")]
    else:
        listed += [("spring", f"-{{c}}*({along})", EITHER), ("cubic spring", f"-{{c}}*({along})^3", EITHER)]
    if along in model.speeds:
        listed.append(("constant force", "{c}", EITHER))
    result = []
    for kind, text, limits in listed:
        (candidate,) = laws(model, f"force({along})", text, f"{kind} {where}", {"c": limits})
        result.append(replace(candidate, form=kind if limits is POSITIVE else ""))
    return result


def _forces(model: FormulaModel, state: str) -> set[str]:
    """Return the terms of an equation that are forces of machines; none unless it is a speed's."""
    rates = _speeds(model)
    if state not in rates.values():
        return set()
    speeds = list(dict.fromkeys(rates.values()))
    places = [name for name in rates if name not in model.angles]
    turning = [*model.angles, *(f"{a} - {b}" for a, b in itertools.combinations(model.angles, 2))]
    drags = [text for v in speeds for text in (v, f"abs({v})*{v}", f"{v}^3")]
    springs = [text for x in places for text in (x, f"{x}^3")]
    return {
        "1",
        *drags,
        *springs,
        *model.inputs,
        *(f"{wave}({a})" for a in turning for wave in ("sin", "cos")),
    }


def _speeds(model: FormulaModel) -> dict[str, str]:
    """Map states whose rate is a state to that state."""
    return {name: model.equations[name].strip() for name in model.kinematic}


def dry(model: FormulaModel, states: NDArray[np.float64]) -> list[Candidate]:
    """List dry friction of every speed and of every relative speed of two bodies, in every speed's equation.

    If an angle's rate is no state, friction of that rate is tried in every equation. With a mass matrix
    friction acts along each coordinate and between two. The sign is smoothed over a width, of which a few are
    tried, in units of the speeds of a motion, (n, d).
    """
    if model.mass:
        return _dry_forces(model, states)
    rates = _speeds(model)
    moving = {name: text for name, text in model.equations.items() if name in rates or name in model.angles}
    size = model.rates(0.0, states) if moving else states
    columns = {name: size[:, model.state_names.index(name)] for name in moving}
    speeds = [
        (text, rates.get(name, f"{name}'"), values)
        for (name, text), values in zip(moving.items(), columns.values(), strict=True)
    ]
    for a, b in itertools.combinations(rates, 2):
        if (a in model.angles) == (b in model.angles):
            text = f"{rates[a]} - {rates[b]}"
            speeds.append((text, text, columns[a] - columns[b]))
    result = []
    for state in model.state_names:
        if state in model.kinematic:
            continue
        for text, said, values in speeds:
            # The friction of another body may drive this one.
            limits = NEGATIVE if text == state else EITHER
            name, title = f"dry_{word_for(said)}_in_{state}", f"dry friction of {said} in {state}'"
            inner = text if text.isidentifier() else f"({text})"
            result += _turning(model, f"{state}'", f"tanh({inner}/{{eps}})", name, title, values, limits)
    return result


#: Forces with a threshold {b}, and the limits of their amplitudes: of a displacement, and of an input. An
#: input's dead zone reduces its gain within the threshold, its limit beyond it. Written as the other one,
#: each would need the whole gain as its amplitude, and zero gain in the known model.
_BEYOND = "(max({x} - {b}, 0) + min({x} + {b}, 0))"
_SMOOTH = ("saturation", "tanh({x}/{b})", EITHER)
_IN_PLACE = (("dead zone", _BEYOND, EITHER), _SMOOTH)
_IN_INPUT = (
    ("dead zone", "min(max({x}, -{b}), {b})", NEGATIVE),
    ("limit", _BEYOND, NEGATIVE),
    _SMOOTH,
)


def thresholds(model: FormulaModel, states: NDArray[np.float64]) -> list[Candidate]:
    """List forces with a threshold in a displacement or an input: dead zones, limits and saturations.

    In addition to a model's proportional force, a dead zone of a displacement describes a spring or a gear
    with play; with the other sign it is a stop. A motor that ignores small inputs has a dead zone of its
    input; one with bounded output has a limit. ``tanh`` is a smooth saturation.
    """
    rates = _speeds(model)
    along = {v: x for x, v in model.speeds.items()} if model.mass else {}
    sizes = {x: states[:, model.state_names.index(x)] for x in rates if x not in model.angles}
    for name in model.inputs:
        if read := [np.asarray(record[name].values) for record in model.records]:
            sizes[name] = np.concatenate(read)
    result = []
    for state in dict.fromkeys(rates.values()):
        if state in model.kinematic:
            continue
        slot = f"force({along[state]})" if state in along else f"{state}'"
        for x, values in sizes.items():
            if float(np.nanstd(values)) < _SWINGS * _typical(values):
                continue  # an argument on one side of zero does not show a zone around zero
            for kind, term, limits in _IN_INPUT if x in model.inputs else _IN_PLACE:
                title = f"{kind} of {x} in {slot}"
                name = f"{word_for(kind)}_of_{x}_in_{_place(slot)}"
                result += _turning(model, slot, term.replace("{x}", x), name, title, values, limits, "b")
    return result


def _dry_forces(model: FormulaModel, states: NDArray[np.float64]) -> list[Candidate]:
    result = []
    for along in _ways(model):
        v, where = _along(model, along)
        columns = [states[:, model.state_names.index(model.speeds[x])] for x in along.split(" - ")]
        name, title = word_for(f"dry {where}"), f"dry friction {where}"
        speed, term = reduce(np.subtract, columns), f"tanh({v}/{{eps}})"
        listed = _turning(model, f"force({along})", term, name, title, speed, NEGATIVE)
        result += [replace(c, form="dry") for c in listed]
    return result


def _typical(values: NDArray[np.float64]) -> float:
    """Compute the root mean square."""
    return float(np.sqrt(np.nanmean(values**2)))


def _turning(
    model: FormulaModel,
    slot: str,
    term: str,
    name: str,
    title: str,
    argument: NDArray[np.float64],
    limits: Range,
    bound: str = "eps",
) -> list[Candidate]:
    """List a term that turns over at widths ``{eps}`` or bounds ``{b}``, shares of its argument's size."""
    typical = _typical(argument)
    if not typical > 0.0:
        return []
    role, shares = ("width", _WIDTHS) if bound == "eps" else ("shape", _BOUNDS)
    values = tuple(share * typical for share in shares)
    shapes = {bound: Shape(role, values)}
    return laws(model, slot, f"{{c}}*{term}", title, {"c": limits}, shapes, [(v,) for v in values], name)


def given_terms(model: FormulaModel, given: Iterable[tuple[str, Expression]]) -> list[Candidate]:
    """Make the terms that a user asks for, each an equation's state and a formula."""
    result = []
    for entry in given:
        if isinstance(entry, str) or not isinstance(entry, (tuple, list)) or len(entry) != 2:
            raise ModelError(
                f"a candidate must be a state and a term, as in ('v', 'abs(v)*v'), not {entry!r:.80}"
            )
        state, term = str(entry[0]).removesuffix("'"), text_of("a candidate", entry[1])
        slot = state if along_of(state) else f"{state}'"
        if slot != state and state not in model.state_names:
            raise ModelError(
                f"there is no equation of {state!r} for the candidate {term!r}; there are "
                f"{', '.join(model.state_names)}"
            )
        candidate = _candidate(model, slot, f"({term})", word_for(term), term)
        candidate.added_to(model)  # which parses it
        result.append(candidate)
    return result


def _candidate(model: FormulaModel, slot: str, text: str, name: str, said: str) -> Candidate:
    (amplitude,) = unused_names(model, "c")
    term = amplitude if text == "1" else f"{amplitude}*{text}"
    title = f"{said} in {slot}"
    values: dict[str, Any] = {amplitude: 0.0}
    effect = effects.formula(slot, term, name=f"{name}_in_{_place(slot)}", title=title, **values)
    return Candidate(effect, title)


def waves(model: Model, frequencies: Iterable[float]) -> list[Candidate]:
    """List a wave of each frequency in each equation that is not just the rate of another state.

    A pendulum has waves in its torque.
    """
    text = "{a}*cos(2*pi*{f}*t) + {b}*sin(2*pi*{f}*t)"
    # The fit may move it within its line.
    amplitudes, shapes = {"a": EITHER, "b": EITHER}, {"f": Shape("frequency", (), EITHER)}
    tried = [(float(f),) for f in frequencies]
    result = []
    for slot in (slot for slot in slots(model) if slot.name != "friction"):
        name, title = f"wave_in_{_place(slot.name)}", f"a wave in {slot.name}"
        for wave in laws(model, slot.name, text, title, amplitudes, shapes, tried, name):
            with_frequency = f"a wave of frequency {wave.effect.values[-1]:.4g} in {slot.name}"
            result.append(replace(wave, title=with_frequency, usual=False))
    return result


def _place(slot: str) -> str:
    """Return a slot as a part of a name."""
    return word_for(slot.removesuffix("'"))


def _of_states(model: FormulaModel) -> list[str]:
    plain = [name for name in (*model.state_names, *model.inputs) if name not in model.angles]
    degree = _DEGREE if len(plain) <= _FEW else 2
    powers = [p for d in range(degree + 1) for p in itertools.combinations_with_replacement(plain, d)]
    powers += [(name,) * _DEGREE for name in plain if degree < _DEGREE]
    result = [_product(p) for p in powers] + [f"abs({name})*{name}" for name in plain]
    turning = list(model.angles) + [f"{a} - {b}" for a, b in itertools.combinations(model.angles, 2)]
    times = plain if len(result) + len(turning) * (2 * len(plain) + 3) <= _MOST else []
    for angle in turning:
        for wave in ("sin", "cos"):
            result += [f"{wave}({angle})"] + [f"{name}*{wave}({angle})" for name in times]
        result.append(f"sin(2*({angle}))" if " " in angle else f"sin(2*{angle})")
    return result


def _product(names: tuple[str, ...]) -> str:
    counted = {name: names.count(name) for name in names}
    return "*".join(name if k == 1 else f"{name}^{k}" for name, k in counted.items()) or "1"
