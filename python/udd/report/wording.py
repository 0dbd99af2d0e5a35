"""The sentences of the page, and the format of its numbers."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from markupsafe import Markup, escape

from udd._util import value_text
from udd._util.small_units import small_unit
from udd.discovery.thresholds import SAME as IDENTICAL
from udd.discovery.validation.held_out_errors import reaches_noise_floor
from udd.effects.user_defined import FormulaSpec
from udd.effects.user_defined import is_spline as is_spline

if TYPE_CHECKING:
    from udd.discovery.results import AddedEffect, Alternative, Discovery
    from udd.effects import Effect
    from udd.models import Model

_SYMBOLS = (
    (r"\bOmega\b", "Ω"),
    (r"\bomega\b", "ω"),
    (r"\bbeta\b", "β"),
    (r"\btheta\b", "θ"),
    (r"\bkappa\b", "κ"),
    (r"\bphi\b", "φ"),
    (r"\beps\b", "ε"),
    (r"\bpi\b", "π"),
    (r"dOmega\b", "dΩ"),
    (r"\^(\d)", r"<sup>\1</sup>"),
    (r"\b([A-Za-z])_([a-z]+)\b", r"\1<sub>\2</sub>"),
    (r"\+-", "±"),
    (r"(?<![\w.])-(?=[\w(|.])", "−"),
    (r" - ", " − "),
    (r" \* ", " "),
    (r"(?<=[\w)])\*(?=[\w(])", " "),
)


@dataclass(frozen=True)
class Headline:
    """The numbers at the top."""

    span: str
    before: str
    after: str
    floor: str
    floor_at: str
    ratio: str
    interval: str
    before_note: str
    after_note: str


def pretty(text: str) -> Markup:
    """Format a formula or a unit: Greek letters, powers, indices, minus signs."""
    result = str(escape(text))
    for pattern, symbol in _SYMBOLS:
        result = re.sub(pattern, symbol, result)
    return Markup(result)


#: The equation of the known model that a slot's effect enters.
_ENTERS = {
    "vertical": "dZ/dT = -Y Omega + W_c",
    "lateral": "dY/dT = Z Omega + u",
    "torque": "I dOmega/dT = ... + torque",
    "friction": "I dOmega/dT = ... - k Omega",
}


def enters(effect: Effect) -> list[str]:
    """List the equations that an effect changes."""
    return [_ENTERS[slot] for slot in effect.slots if slot in _ENTERS]


def verdict(discovery: Discovery) -> str:
    """Sum up the result in a sentence, and a second one if the search was not finished."""
    said = _verdict(discovery)
    if discovery.stopped is None:
        return said
    return (
        f"{said} The search ended after {discovery.budget:.3g} s, as asked, while "
        f"{discovery.stopped}; further effects were not tried. A larger budget tries them."
    )


def _verdict(discovery: Discovery) -> str:
    said = "; and ".join(_counted(["; or ".join(_meanings(f, discovery)) for f in discovery.effects]))
    if discovery.verdict == "fits the first part, not confirmed":
        titles = list(
            dict.fromkeys(
                candidate.title for candidate in discovery.rejected if candidate.why == "unconfirmed"
            )
        )
        said = " and ".join(titles)
        return (
            f"Not confirmed: {said} {'fit' if len(titles) > 1 else 'fits'} the first part of the record, but "
            "free runs over the held-out part do not clearly improve."
        )
    if discovery.verdict == "search not finished":
        return "The search has not ended: no missing effect was found so far."
    if not discovery.effects and discovery.verdict != "nothing missing" and discovery.stopped:
        return "The model lacks something, but the search has not yet found what."
    if not discovery.effects and discovery.verdict != "nothing missing":
        return "The model lacks something, but no effect of the library explains what."
    if discovery.verdict == "nothing missing" and not reaches_noise_floor(discovery.error_before):
        return (
            "No effect of the library is clearly missing; yet the known model does not explain "
            "this motion down to the noise of the measurement."
        )
    if discovery.verdict == "nothing missing":
        return (
            "Nothing is missing: the known model explains this motion down to the noise of the measurement."
        )
    if discovery.verdict == "effect identified":
        return f"{said[0].upper()}{said[1:]}."
    return f"The model lacks something. Most likely {said}; but this record does not determine its form."


def _counted(sentences: list[str]) -> list[str]:
    """Return each sentence once, with the number of terms that one equation has more of."""
    counts = {text: sentences.count(text) for text in sentences}
    return [
        text if n == 1 else text.replace(" one more term", f" {n} more terms") for text, n in counts.items()
    ]


def rejected(discovery: Discovery) -> list[str]:
    """Say what comes nearest if nothing passes, and why each does not pass.

    Effects with the same errors and the same reason share a sentence.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for candidate in discovery.rejected:
        numbers = headline(replace(discovery, error_after=candidate.errors, ratio=candidate.ratio))
        why = {
            "chance": f"χ² decreases by {candidate.chi2:.1f} in units of the remaining scatter at these "
            f"frequencies, and the probability of that by chance is {probability(candidate.p)}",
            "drift": "a slow drift of the sensor's zero would explain more",
            "part": "the first part of the record does not show it beyond chance",
            "unconfirmed": "that is not clearly an improvement",
            "held": "the held-out frames do not confirm it",
            "form": "another form fits these data clearly better, and was rejected",
            "records": "only some of the records need it",
        }[candidate.why]
        key = (numbers.span, numbers.before, numbers.after, numbers.ratio, numbers.interval, why)
        groups.setdefault(key, []).append(f"{candidate.title} ({candidate.effect.expression})")
    return [
        f"{' or '.join(names)} would bring the held-out error {span} from {before} to {after}, "
        f"ratio {ratio} ({interval}), but {why}."
        for (span, before, after, ratio, interval, why), names in groups.items()
    ]


def _meanings(added: AddedEffect, discovery: Discovery) -> list[str]:
    """Describe an added effect and the effects that act identically."""
    same = [
        a.effect
        for a in discovery.alternatives
        if a.likeness > IDENTICAL and a.instead_of == added.effect.name
    ]
    sentences = [effect_sentence(e) for e in [added.effect, *same]]
    if added.curve is None and isinstance(added.effect.spec, FormulaSpec) and enters(added.effect):
        sentences[0] = f"there is {added.title}"  # the meaning of a formula names only its slot
    if added.curve is not None:  # the meaning says where, the curve says with what
        sentences[0] += f", depending on {' and '.join(along(c.name) for c in added.curve.coordinates)}"
    return list(dict.fromkeys(sentences))


def along(name: str) -> str:
    """Name a coordinate in a sentence."""
    return {
        "Y": "the sideways place Y of the disk's centre",
        "Z": "the height Z of the disk's centre",
        "R": "the distance R of the disk's centre from the contact",
        "theta": "the direction θ",
        "beta": "the orientation β",
        "Omega": "the angular velocity Ω",
        "|Omega|": "the speed |Ω| of the rotation",
        "t": "time",
    }.get(name, name)


def values_of(added: AddedEffect, units: dict[str, str]) -> Markup:
    """List an effect's parameters in a sentence."""
    texts = []
    for name, value in added.parameters.items():
        unit = unit_words(units.get(f"{added.effect.name}.{name}", ""))
        number = Markup("<b>{} = {}</b>").format(pretty(name), with_error(value, added.errors.get(name)))
        texts.append(number + Markup(" ") + unit if unit else number)
    return Markup(", ").join(texts)


def effect_sentence(effect: Effect) -> str:
    """Describe an effect as a clause."""
    meaning = str(effect.meaning).rstrip(".")
    return f"there is {meaning}" if meaning.startswith(("a ", "an ", "dry ")) else meaning


def headline(discovery: Discovery) -> Headline:
    """Format the held-out errors on which the decision rests."""
    h = discovery.horizon
    before, after = discovery.error_before, discovery.error_after
    unit = before.unit
    if h is None:
        span, values = "over all of it (r.m.s.)", (before.whole, after.whole)
        h = before.horizons[-1]
    else:
        span, values = f"after {h:.3g}\u00a0s", (before.at(h)[0], after.at(h)[0])
    value, low, high = discovery.ratio
    floor = after.at(h)[3]
    notes = ["no more than noise" if error <= floor else "" for error in values]
    return Headline(
        span=span,
        before=length(values[0], unit),
        after=length(values[1], unit),
        floor=length(floor, unit),
        floor_at=f"{h:.3g}\u00a0s",
        ratio=f"{value:.2g}",
        interval=f"{low:.2g} to {high:.2g}" if math.isfinite(low) else "not known: too few blocks",
        before_note=notes[0],
        after_note=notes[1],
    )


def noise(discovery: Discovery) -> str:
    """Describe the noise of each channel, and the steps of its readings."""
    said = "; ".join(one.text for one in discovery.noise)
    averaged = discovery.thinned and discovery.thinned[0].every > 1
    return f"{said} (means of {discovery.thinned[0].every} frames)" if averaged else said


def length(value: float, unit: str) -> str:
    """Format an error with its unit: mm or mrad, or per cent of a motion's spread."""
    if not math.isfinite(value):
        return "–"
    small, factor = small_unit(unit)
    return f"{_digits(factor * value, 3)} {small.removesuffix(' of the spread')}"


def _digits(value: float, n: int) -> str:
    """Format a number with so many significant digits, without an exponent."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    decimals = max(0, n - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{decimals}f}"


def with_error(value: float, error: float | None) -> str:
    """Format a value with two digits of its standard error in brackets: ``5.03(12)``."""
    text = value_text.with_error(value, error, " × 10<sup>{}</sup>").replace("-", "−")
    return Markup(text) if "<" in text else text


def probability(p: float) -> str:
    """Format a small probability."""
    if p < 1e-3:
        power = math.floor(math.log10(max(p, 1e-300))) + (1 if p > 1e-300 else 0)
        return Markup(f"below 10<sup>−{-power}</sup>")
    return f"{min(p, 1.0):.2g}"


def confirmed_by(effect: AddedEffect) -> str:
    """Describe the evidence of the held-out frames for an effect."""
    value, low, high = effect.ratio
    cost = (
        "With all parameters fixed, the cost of the held-out frames (their squared misfits in units of the "
        f"noise) changed by the factor {value:.3g} (95 % interval {low:.3g} to {high:.3g})"
    )
    if effect.witness == "held":
        return f"{cost}."
    if effect.witness == "fitted":
        return f"{cost}; in a fit that includes them, χ² decreased by more than chance would."
    return (
        f"{cost}: they hardly show it. The record was also cut into two halves of alternate stretches. In "
        "each half, χ² decreased by more than chance allows."
    )


def unit_words(unit: str) -> str:
    """Write a unit in words: ``1/m`` becomes ``per metre``."""
    return {"1/m": "per metre", "1/s": "per second", "": ""}.get(unit, pretty(unit))


def title_of(discovery: Discovery, name: str) -> str:
    """Return the title of an added effect."""
    return next((f.effect.title for f in discovery.effects if f.effect.name == name), name)


def limit(other: Alternative) -> str:
    """Explain why an alternative stays open."""
    if other.likeness > IDENTICAL and other.effect.slots[0].endswith("'"):
        return "On these data the two act identically."
    if other.likeness > IDENTICAL:
        return (
            "At one drive speed the two act on the disk identically, and a longer record would not "
            "distinguish them: film a second drive and fit both together."
        )
    if other.nats < -0.1:
        better = f"{abs(other.nats):.1f} units of log-likelihood"
        return f"It fits even better (by {better}), but was not chosen: it fails another test."
    return (
        f"It fits worse by {abs(other.nats):.1f} units of log-likelihood; a form is excluded from 10 on. "
        "A longer record, or a wider range of motion, would decide."
    )


def command(discovery: Discovery, source: str | None) -> str | None:
    """Return the command of `udd discover` for the same analysis; None if the file is not known."""
    bare_model = discovery.baseline.problem.models[0]
    if (
        source is None
        or bare_model.effects
        or bare_model.profile.written
        or len(discovery.fit.measurements) > 1
    ):
        return None
    given = [next(iter(bare_model.parameters))]  # which has no default
    made: Callable[[float], Model] = type(bare_model)
    usual = made(bare_model.parameters[given[0]])
    given += [name for name, value in bare_model.parameters.items() if value != usual.parameters[name]]
    names = bare_model.profile.shown.options
    options = (f"--{names.get(name, name)} {bare_model.parameters[name]!r}" for name in dict.fromkeys(given))
    return f"udd discover {shlex.quote(source)} {' '.join(options)} --report report.html"


def short_limits(discovery: Discovery) -> list[str]:
    """List the limits that must stand next to the verdict."""
    same = [a for a in discovery.alternatives if a.likeness > IDENTICAL]
    if not same:
        return []
    names = " or ".join(
        dict.fromkeys(f"{a.effect.title} ({a.effect.equation})" for a in same if a.effect.title)
    )
    return [
        f"At one drive speed it cannot be distinguished from {names}: a film at a second drive would decide."
    ]


def limits(discovery: Discovery) -> list[str]:
    """List the limits of the data."""
    result = []
    if discovery.verdict == "nothing missing":
        result.append(
            "An effect too small for this record may still be present: “nothing missing” means that these "
            "data need no further effect."
        )
    if discovery.curves:
        result.append(
            "Besides the effects of the library, every equation was searched for a smooth curve along each "
            "coordinate and pair of coordinates. Effects of three or more coordinates, or of the past, were "
            "not searched."
        )
    else:
        result.append("Only the effects of the library were tried; the table above lists the best.")
    result.append(discovery.fit.model.profile.shown.taken_as_known)
    return result
