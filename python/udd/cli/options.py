"""Options that several commands share, and what they say as models."""

from __future__ import annotations

import argparse
import warnings
from typing import TYPE_CHECKING, Any

from udd._util.number_text import number_in
from udd.errors import UddError

from .suggestions import meant

if TYPE_CHECKING:
    from udd.effects import Effect
    from udd.models import Disk, Pendulum


def new(
    commands: Any, name: str, run: Any, summary: str, examples: tuple[str, ...] = (), notes: str = ""
) -> argparse.ArgumentParser:
    """Add a command with the common options; `examples` end its help, after `notes`."""
    shown = "\n".join(["examples:", *(f"  {one}" for one in examples)])
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        description=summary,
        epilog=f"{notes}\n{shown}" if notes else shown,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.summary = summary  # type: ignore[attr-defined]
    parser.examples = examples  # type: ignore[attr-defined]
    parser.add_argument(
        "--json", action="store_true", help="print JSON, and nothing else, to standard output"
    )
    parser.set_defaults(run=run, command=name)
    return parser


def add_disk(parser: argparse.ArgumentParser, drive: str) -> None:
    """Add the disk's parameters."""
    group = parser.add_argument_group("the disk")
    speed = group.add_mutually_exclusive_group()
    speed.add_argument("--W", type=float, metavar="M/S", help=drive)
    speed.add_argument("--disk", dest="W", type=float, metavar="M/S", help="another name of --W")
    speed.add_argument(
        "--rate",
        dest="W",
        type=_rim_speed,
        metavar="RAD/S[:M]",
        help="in place of --W: rate of turning of the drive wheel, and its radius (default 0.03)",
    )
    group.add_argument("--R", type=float, metavar="M", help="radius [m] (default 0.08)")
    group.add_argument("--g", type=float, help="gravity [m/s^2] (default 9.81)")
    for name, unit in (("k0", "m^2/s, fast"), ("k1", "m^2/s, at rest"), ("k2", "m^2, fall with the speed")):
        group.add_argument(f"--{name}", type=float, help=f"friction [{unit}] (default: the paper's)")
    add_effects(parser)


def _rim_speed(text: str) -> float:
    """Compute the speed of a wheel's rim from ``rate`` or ``rate:radius``."""
    rate, colon, radius = text.partition(":")
    try:
        speed = number_in(rate) * (number_in(radius) if colon else 0.03)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a rate [rad/s], or rate:radius [rad/s:m]: {error}"
        ) from None
    if not speed >= 0:
        raise argparse.ArgumentTypeError(
            f"the rate and the wheel's radius must not be negative, as in {text!r}"
        )
    return speed


def add_effects(parser: argparse.ArgumentParser) -> None:
    """Effects by name."""
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME:P=V,...",
        help="an effect with its parameters, such as relaxation:b=5,momentum=constraint; repeatable",
    )


#: The options of each kind of model, as they are called in the parsed arguments.
_TAKEN = {
    "disk": ("W", "R", "g", "k0", "k1", "k2", "effect", "ignore_edge"),
    "pendulum": ("pendulum", "inertia", "g", "k0", "effect"),
    "dle": ("w", "B"),
    "own": ("model", "inputs"),
}
_KINDS = {
    "disk": "a disk",
    "pendulum": "a pendulum",
    "dle": "the DLE (--w)",
    "own": "a model of your own (--model)",
}


def refuse_others(args: argparse.Namespace, kind: str, where: str = "") -> None:
    """Refuse options that this kind of model does not take: they would do nothing.

    Raises
    ------
    UddError
        Naming the option and the model; the sentence begins with `where`.
    """
    for name in dict.fromkeys(name for taken in _TAKEN.values() for name in taken):
        value = getattr(args, name, None)
        if name in _TAKEN[kind] or value is None or value is False or value == []:
            continue
        option = "--W (--rate)" if name == "W" else f"--{name.replace('_', '-')}"
        raise UddError(f"{where}{option} does not apply to {_KINDS[kind]}")


# Numbers in cm are a hundred times those in m: between the two are these.
_FAST = 0.5  # m/s: the device's drive is a tenth of that
_WIDE = 1.0  # m: radius of a disk; the device's is 0.08 m
_LONG = 10.0  # m: length of a pendulum


def _doubt(name: str, value: float, most: float, unit: str, usual: str) -> None:
    """Warn of a number that seems to be in centimetres."""
    if most < value < float("inf"):
        centimetres = unit.replace("m", "cm")
        text = f"{name} is {value:g} {unit}; expected {usual}. Is it in {centimetres}?"
        warnings.warn(text, UserWarning, stacklevel=3)


def disk(args: argparse.Namespace, W: float, R: float) -> Disk:
    """Make the disk that the options describe."""
    from udd.models import Disk

    _doubt("W", W, _FAST, "m/s", "about 0.04 m/s")
    _doubt("R", R, _WIDE, "m", "about 0.08 m")
    return Disk(W, R=R, effects=effects(args.effect), **given(args, "g", "k0", "k1", "k2"))


def pendulum(args: argparse.Namespace, length: float, inertia: float | None) -> Pendulum:
    """Make the pendulum that the options describe."""
    from udd.models import Pendulum

    _doubt("length", length, _LONG, "m", f"at most {_LONG:g} m")
    return Pendulum(length, inertia=inertia, effects=effects(args.effect), **given(args, "g", "k0"))


def given(args: argparse.Namespace, *names: str) -> dict[str, Any]:
    """List the given ones among these options."""
    return {name: getattr(args, name) for name in names if getattr(args, name) is not None}


def add_pendulum(parser: argparse.ArgumentParser, length: str = "pivot to centre of mass [m]") -> None:
    """Add the options of a pendulum."""
    group = parser.add_argument_group("a pendulum instead of the disk")
    group.add_argument("--pendulum", type=float, metavar="LENGTH", help=length)
    group.add_argument(
        "--inertia", type=float, help="about the pivot, per unit mass [m^2] (default LENGTH^2)"
    )


def effects(texts: list[str]) -> tuple[Effect, ...]:
    """Effects from ``name:p=v,...``."""
    from udd.effects import library
    from udd.errors import ModelError

    specs = {spec.name: spec for spec in library()}
    result = []
    for text in texts:
        name, _, rest = text.partition(":")
        if name not in specs:
            raise ModelError(f"no effect is called {name!r}{meant(name, specs)} (udd effects lists them)")
        values: dict[str, float] = {}
        choices: dict[str, str] = {}
        for item in filter(None, rest.split(",")):
            key, equals, value = item.partition("=")
            if key.strip() in ("momentum", "treatment"):
                choices[key.strip()] = value.strip()
                continue
            try:
                if not equals:
                    raise ValueError
                values[key.strip()] = number_in(value)
            except ValueError:
                raise ModelError(
                    f"--effect {text}: {item!r} is not of the form parameter=number (with a decimal point)"
                ) from None
        momentum, treatment = choices.get("momentum"), choices.get("treatment")
        result.append(specs[name].make(momentum=momentum, treatment=treatment, **values))
    return tuple(result)


def names(texts: list[str]) -> list[str]:
    """Names given apart or with commas, each once."""
    return list(dict.fromkeys(name.strip() for text in texts for name in text.split(",") if name.strip()))


def numbers(texts: list[str], what: str) -> list[float]:
    """Read numbers from several texts, or from a single text with commas between them.

    Raises
    ------
    UddError
        A text holds no number; or there are several texts with commas in them, which may be decimal commas.
    """
    if len(texts) > 1 and any("," in text.strip().rstrip(",") for text in texts):
        raise UddError(
            f"{what}: separate numbers by commas or by spaces, not by both; the decimal sign is a point; got "
            f"{' '.join(texts)}"
        )
    try:
        return [number_in(item) for text in texts for item in text.split(",") if item.strip()]
    except ValueError:
        raise UddError(f"{what} must be numbers, not {' '.join(texts)}") from None
