"""Friction that depends on more than the speed's sign or square, in a user's own mechanical model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd import effects
from udd.effects.user_defined import written
from udd.models.formula_model import FormulaModel

from .candidate import Candidate
from .term_library import unused_names, word_for

Array = NDArray[np.float64]

#: Powers of the speed by which friction grows, that a scan tries: 1 is quadratic drag, 2 a cubic one.
POWERS = (0.4, 0.7, 1.4, 1.7, 2.5)
#: Times in which friction settles, in units of the record's length.
DURATIONS = (0.02, 0.05, 0.12, 0.3, 0.7)
_WIDTHS = (0.06, 0.15, 0.4)  # of the range that the motion visits
_SPEEDS = 9  # parts of the range of speeds, in the middle of which drag may begin
_ROUND = 1e-3  # of a speed's root mean square, within which corners are rounded off
_TURNS = 0.03  # of the same, over which the sign of dry friction under load turns over
_BRAKE, _EITHER = (-np.inf, 0.0), (-np.inf, np.inf)


def places(visited: Array, width: float, *, angle: bool = False) -> list[float]:
    """Places a width from each other, within what a motion visits; one turn of an angle that goes round."""
    low, high = float(np.min(visited)), float(np.max(visited))
    if angle and high - low > 2 * np.pi:
        low, high = 0.0, 2 * np.pi
    return [low + width * (k + 0.5) for k in range(int((high - low) / width))] if width > 0.0 else []


def speeds(visited: Array) -> list[float]:
    """Speeds between rest and the fastest."""
    fastest = float(np.abs(visited).max())
    return [fastest * (k + 0.5) / _SPEEDS for k in range(_SPEEDS)]


@dataclass(frozen=True)
class Joint:
    """A coordinate of a mechanical model that friction may act on.

    Attributes
    ----------
    x, v : str
        The states that are the coordinate and its rate.
    slot : str
        Where a force on it enters.
    places, speeds : ndarray (n,)
        What a motion makes of them.
    angle : bool
    """

    x: str
    v: str
    slot: str
    places: Array
    speeds: Array
    angle: bool

    @property
    def typical(self) -> float:
        """The speed's root mean square."""
        return float(np.sqrt(np.nanmean(self.speeds**2)))


def _joints(model: FormulaModel, states: Array) -> list[Joint]:
    """The coordinates whose speed has an equation of its own, if the motion moves them."""
    result = []
    for x, v in model.speeds.items():
        where, fast = (states[:, model.state_names.index(name)] for name in (x, v))
        result.append(Joint(x, v, f"force({x})" if model.mass else f"{v}'", where, fast, x in model.angles))
    moving = [joint for joint in result if joint.v not in model.kinematic]
    return [joint for joint in moving if joint.typical > 0.0 and np.isfinite(joint.typical)]


def load_frictions(model: FormulaModel, states: Array) -> list[Candidate]:
    """Dry friction of every joint that grows with the load of a pendulum: its weight, and what turns it.

    Parameters
    ----------
    model : FormulaModel
    states : ndarray (n, d)
        A motion, which says how wide the turn of the sign may be.
    """
    result = []
    for joint in _joints(model, states):
        if joint.angle:
            text = f"({{c}}*cos({joint.x}) + {{d}}*{joint.v}^2)*tanh({joint.v}/{_TURNS * joint.typical:.3g})"
            limits = {"c": _BRAKE, "d": _BRAKE}
            result += _listed(model, joint, "dry friction growing with the load", text, limits, [{}])
    return result


def frictions(model: FormulaModel, states: Array, duration: float) -> list[list[Candidate]]:
    """Of every joint: drag with a power, or above a speed, friction that settles with time, or near a place.

    Parameters
    ----------
    model : FormulaModel
    states : ndarray (n, d)
        A motion, which says where and how fast it goes.
    duration : float
        How long it takes.

    Returns
    -------
    list of list of Candidate
        For each law the values of its shapes that are tried.
    """
    result = []
    for joint in _joints(model, states):
        x, v = joint.x, joint.v
        small = f"{(_ROUND * joint.typical) ** 2:.3g}"
        power = f"{{c}}*({v}^2 + {small})^({{n}}/2)*{v}"
        tried = [{"n": value} for value in POWERS]
        result.append(_listed(model, joint, "power of the speed", power, {"c": _BRAKE}, tried))
        settling, times = f"{{c}}*exp(-t/{{tau}})*{v}", [{"tau": share * duration} for share in DURATIONS]
        title = "friction that settles with time"
        result.append(_listed(model, joint, title, settling, {"c": _EITHER}, times))
        away = f"2*sin(({x} - {{b}})/2)" if joint.angle else f"{x} - {{b}}"
        near, span = f"{{c}}*exp(-(({away})/{{s}})^2)*{v}", float(np.ptp(joint.places))
        span = min(span, 2 * np.pi) if joint.angle else span
        tried = [
            {"b": place, "s": share * span}
            for share in _WIDTHS
            for place in places(joint.places, share * span, angle=joint.angle)
        ]
        result.append(_listed(model, joint, f"friction near a place of {x}", near, {"c": _BRAKE}, tried))
        above = f"(abs({v}) - {{b}})"
        beyond = f"{{c}}*({above} + sqrt({above}^2 + {small}))/2*{v}"
        tried = [{"b": speed} for speed in speeds(joint.speeds)]
        result.append(_listed(model, joint, "drag above a speed", beyond, {"c": _BRAKE}, tried))
    return [listed for listed in result if listed]


def _listed(
    model: FormulaModel,
    joint: Joint,
    kind: str,
    text: str,
    limits: dict[str, tuple[float, float]],
    tried: Sequence[dict[str, float]],
) -> list[Candidate]:
    """A law in a joint with each value of its shapes; braces in its text are parameters."""
    if not tried:
        return []
    title, shapes = f"{kind} in {joint.slot}", list(tried[0])
    names = unused_names(model, *limits, *shapes)
    called = dict(zip((*limits, *shapes), names, strict=True))
    linear = [called[name] for name in limits]
    ranges = {called[name]: limits[name] for name in limits}
    ranges |= {called[name]: (0.0, np.inf) for name in shapes if name != "b"}
    spec = written(joint.slot, text.format(**called), word_for(title), title, linear, ranges, tuple(names))
    first = called[shapes[0]] if shapes else ""
    # A width that goes with a place is a shape: the place's prior is as wide.
    listed = (
        p if p.role == "amplitude" else replace(p, role="scanned" if p.name == first else "shape", grid=_FREE)
        for p in spec.parameters
    )
    spec = replace(spec, parameters=tuple(listed))
    zero = (0.0,) * len(linear)
    return [Candidate(effects.Effect(spec.name, (*zero, *one.values()), made=spec), title) for one in tried]


_FREE = (0.5, 1.5)  # the grid of a shape that may have any value
