"""Friction beyond the speed's sign or square, in a user's own mechanical model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from udd.effects.user_defined import FormulaSpec, written
from udd.models import Model
from udd.models.formula_model import FormulaModel

from .candidate import ONE_WAY, Candidate
from .written_laws import EITHER, NEGATIVE, Shape, laws

Array = NDArray[np.float64]

#: Powers of the speed in the friction coefficient that a scan tries: 1 is quadratic drag, 2 a cubic one.
POWERS = (-0.7, -0.4, -0.2, 0.2, 0.4, 0.7, 1.4, 1.7, 2.5)
#: Settling times of friction, in units of the record's length.
DURATIONS = (0.02, 0.05, 0.12, 0.3, 0.7)
_WIDTHS = (0.06, 0.15, 0.4)  # share of the visited range
_ANGLES = (0.1, 0.3, 0.8)  # the same of an angle, rad
_SPEEDS = 9  # parts of the range of speeds; drag may begin in the middle of each
_ROUND = 1e-3  # share of a speed's root mean square within which corners are rounded off
_TURNS = 0.03  # the same for the sign of dry friction under load
# Shapes that may have any value, of which scores choose one: a power or a time, and a place or a speed. The
# width at a place is a shape, and the prior of the place has the same width.
_FREE = (0.5, 1.5)
_SIZE, _PLACE, _WIDTH = Shape("scanned", _FREE), Shape("scanned", _FREE, EITHER), Shape("shape", _FREE)
_EXPONENT = Shape("scanned", _FREE, (-0.95, np.inf))  # as of `power_drag`; -1 would be dry friction


def places(visited: Array, width: float, *, angle: bool = False) -> list[float]:
    """Return places a width apart within the visited range; at most one turn of an angle."""
    low, high = float(np.min(visited)), float(np.max(visited))
    if angle and high - low > 2 * np.pi:
        low, high = 0.0, 2 * np.pi
    return [low + width * (k + 0.5) for k in range(int((high - low) / width))] if width > 0.0 else []


def speeds(visited: Array) -> list[float]:
    """Return speeds between zero and the fastest."""
    fastest = float(np.abs(visited).max())
    return [fastest * (k + 0.5) / _SPEEDS for k in range(_SPEEDS)]


@dataclass(frozen=True)
class Joint:
    """Coordinate x of a mechanical model on which friction may act, its rate v, and both along a motion."""

    x: str
    v: str
    slot: str
    places: Array
    speeds: Array
    angle: bool

    @property
    def typical(self) -> float:
        """Root mean square of the speed."""
        return float(np.sqrt(np.nanmean(self.speeds**2)))


def _joints(model: FormulaModel, states: Array) -> list[Joint]:
    """Return the coordinates with a dynamic equation for the speed, if the motion changes them."""
    result = []
    for x, v in model.speeds.items():
        where, fast = (states[:, model.state_names.index(name)] for name in (x, v))
        result.append(Joint(x, v, f"force({x})" if model.mass else f"{v}'", where, fast, x in model.angles))
    moving = [joint for joint in result if joint.v not in model.kinematic]
    return [joint for joint in moving if joint.typical > 0.0 and np.isfinite(joint.typical)]


def load_frictions(model: FormulaModel, states: Array) -> list[Candidate]:
    """List dry friction in every joint that grows with a pendulum's load (weight and centrifugal force).

    A motion, (n, d), determines the width of the smoothed sign.
    """
    result = []
    for joint in _joints(model, states):
        if joint.angle:
            text = f"({{c}}*cos({joint.x}) + {{d}}*{joint.v}^2)*tanh({joint.v}/{_TURNS * joint.typical:.3g})"
            title = f"dry friction growing with the load in {joint.slot}"
            result += laws(model, joint.slot, text, title, {"c": NEGATIVE, "d": NEGATIVE})
    return result


def frictions(model: FormulaModel, states: Array, duration: float) -> list[list[Candidate]]:
    """List frictions of every joint: a power of the speed, above a speed, settling, or near a place.

    Each law has one candidate for each value of its shapes. A motion, (n, d), determines the ranges of places
    and speeds.
    """
    result = []
    for joint in _joints(model, states):
        x, v, slot = joint.x, joint.v, joint.slot
        small = f"{(_ROUND * joint.typical) ** 2:.3g}"
        power = f"{{c}}*({v}^2 + {small})^({{n}}/2)*{v}"
        title, tried = f"power of the speed in {slot}", [(value,) for value in POWERS]
        result.append(laws(model, slot, power, title, {"c": NEGATIVE}, {"n": _EXPONENT}, tried))
        settling, times = f"{{c}}*exp(-t/{{tau}})*{v}", [(share * duration,) for share in DURATIONS]
        title = f"friction that settles with time in {slot}"
        result.append(laws(model, slot, settling, title, {"c": EITHER}, {"tau": _SIZE}, times))
        away = f"2*sin(({x} - {{b}})/2)" if joint.angle else f"{x} - {{b}}"
        local, span = f"{{c}}*exp(-(({away})/{{s}})^2)*{v}", float(np.ptp(joint.places))
        span = min(span, 2 * np.pi) if joint.angle else span
        where = [
            (place, share * span)
            for share in _WIDTHS
            for place in places(joint.places, share * span, angle=joint.angle)
        ]
        title = f"friction near a place of {x} in {slot}"
        result.append(laws(model, slot, local, title, {"c": NEGATIVE}, {"b": _PLACE, "s": _WIDTH}, where))
        above = f"(abs({v}) - {{b}})"
        beyond = f"{{c}}*({above} + sqrt({above}^2 + {small}))/2*{v}"
        title, tried = f"drag above a speed in {slot}", [(speed,) for speed in speeds(joint.speeds)]
        result.append(laws(model, slot, beyond, title, {"c": NEGATIVE}, {"b": _PLACE}, tried))
    return [listed for listed in result if listed]


def one_way(model: Model, speed: Array) -> list[Candidate]:
    """List frictions of a disk or a pendulum that differ by the direction of motion: even in the speed.

    A motion (n,) that hardly turns back does not distinguish them from other friction.
    """
    if not abs(np.mean(speed)) < np.std(speed):
        return []
    linear, quadratic = ONE_WAY
    listed = (
        (linear, "friction that depends on the direction", "-{a}*abs(Omega)"),
        (quadratic, "quadratic drag that depends on the direction", "-{a}*Omega^2"),
    )
    return [
        candidate
        for name, title, text in listed
        for candidate in laws(model, "torque", text, title, {"a": EITHER}, name=name)
    ]


def further() -> tuple[FormulaSpec, ...]:
    """Describe frictions that the library lacks, each with a scanned number."""
    brake, size = (0.0, np.inf), (1e-3, np.inf)

    def at_angle(name: str, title: str, at: str, turn: str, along: str) -> FormulaSpec:
        ranges, names = {"a": brake, "s": size}, ("a", "c", "s")
        spec = written("torque", f"-a*({at})*{turn}", name, title, ["a"], ranges, names)
        a, c, s = spec.parameters
        width = replace(s, role="shape", grid=_ANGLES)
        return replace(spec, parameters=(a, replace(c, role="scanned", along=along), width))

    def over_speed(name: str, title: str, text: str) -> FormulaSpec:
        spec = written("torque", text, name, title, ["a"], {"a": brake, "b": size}, ("a", "b"))
        a, b = spec.parameters
        return replace(spec, parameters=(a, replace(b, role="scanned", along="speed")))

    here, there = (f"exp(-(2*sin((beta {sign} c)/2)/s)^2)" for sign in "-+")
    title = "friction near an angle on both sides"
    both = at_angle("two_brakes", title, f"{here} + {there}", "Omega", "side")
    return (
        at_angle("dry_brake", "dry friction near an angle", here, "tanh(Omega/0.05)", "angle"),
        # Without this, two magnets at 1.4 and -1.4 rad are identified as one at -1.4 rad.
        replace(both, bodies=tuple(body for body in both.bodies if body == "pendulum")),
        over_speed("saturating", "friction that saturates with the speed", "-a*tanh(Omega/b)"),
        # Without this, a magnet's brake is identified as friction that saturates.
        over_speed("eddy_brake", "brake by eddy currents", "-a*Omega/(1 + (Omega/b)^2)"),
    )
