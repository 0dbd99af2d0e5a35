"""The report of a search for what the model of a disk or pendulum lacks."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from markupsafe import Markup

from udd.discovery.validation.by_record import belief
from udd.plot.inputs import first_film

from . import animation, figures, tables, wording
from .document import (
    Bullets,
    Column,
    Figure,
    Head,
    Number,
    Paragraph,
    Part,
    Section,
    Subheading,
    Table,
    Text,
    parts,
    table,
)
from .loose_fit import loosest
from .wording import pretty

if TYPE_CHECKING:
    from udd.discovery.results import AddedEffect, Discovery
    from udd.fitting.innovations import Innovations

#: What a model, and one to which something was added, are called over a column of numbers.
BEFORE, AFTER = "known model", "with the effect"


def head(discovery: Discovery, kicker: str, said: Iterable[Paragraph], unit: str = "") -> Head:
    """What stands first: the verdict, what was added, and the held-out errors; `unit` says theirs."""
    numbers = wording.headline(discovery)
    if believed := belief(discovery.by_record):
        said = [Paragraph(believed), *said]
    shown = [
        Number(
            f"error of the known model {numbers.span}, on data it had not seen{unit}",
            numbers.before,
            style="before",
        )
    ]
    if discovery.effects:
        interval = f"95 % interval {numbers.interval}"
        shown += [
            Number("the same with what was added", numbers.after, style="after"),
            Number("error after over before", numbers.ratio, interval),
        ]
    floor = f"noise floor after {numbers.floor_at}: what a faultless model would score"
    notes = [Paragraph(f"A frame is good to: {wording.noise(discovery)}.")]
    notes += [Paragraph(remark, "warn") for remark in discovery.remarks]
    if not discovery.fit.converged:
        settled = "The fit did not converge: no model that was tried settles on these data."
        notes.append(Paragraph(f"{settled} Read every number below with care.", "warn"))
    return Head(
        kicker,
        wording.verdict(discovery),
        discovery.verdict,
        tuple(said),
        (*shown, Number(floor, numbers.floor)),
        tuple(notes),
    )


def disk_head(discovery: Discovery) -> Head:
    """The same of a disk or pendulum."""
    thing = discovery.fit.model.profile.shown.noun
    said = [Paragraph(_formula(effect, discovery), "formula") for effect in discovery.effects]
    said += [Paragraph(pretty(sentence)) for sentence in wording.short_limits(discovery)]
    return head(discovery, f"What the model of the {thing} lacks", said)


def _formula(found: AddedEffect, discovery: Discovery) -> Markup:
    effect = found.effect
    changed = [pretty(equation) + Markup(", &ensp;") for equation in wording.enters(effect)]
    values = Markup("")
    if not wording.is_spline(effect):
        values = Markup(" &ensp;with ") + wording.values_of(found, discovery.fit.model.units)
    return Markup("").join(changed) + pretty(found.equation) + values


def sections(
    discovery: Discovery, film: str | os.PathLike[str] | None, surprises: Sequence[Innovations]
) -> tuple[Section, ...]:
    """What follows: the motion, the errors, the residuals, the candidates, the limits and the numbers."""
    # Motions are shown of the first film, where several were fitted together.
    one = replace(discovery, baseline=first_film(discovery.baseline), fit=first_film(discovery.fit))
    made = [_measured(discovery, one, film), _errors(discovery), _residuals(discovery, surprises)]
    if not discovery.effects:
        return (*made, _tried(discovery), _limits(discovery), _numbers(discovery, one))
    return (*made, _tried(discovery), others(discovery), _limits(discovery), _numbers(discovery, one))


def _measured(discovery: Discovery, one: Discovery, film: str | os.PathLike[str] | None) -> Section:
    profile = discovery.fit.model.profile.shown
    disk = profile.contact
    movie = animation.side_by_side(one, film)
    moving = (
        f"{'The film' if movie.filmed else 'The measured motion'} beside the models, at half its speed. At T "
        f"= {movie.start:.1f} s, where the data held back from the search begin, each model is let go from "
        "its own best estimate of the state there; then it sees no more data. "
    )
    chaotic = "The motion is chaotic: sooner or later every model parts from it, the right one last."
    overlay = (
        "Frames of the film. Light blue: the fitted disk and its centre. Rings: where its four marks should "
        "be. Cross: the contact, where the wheels hold the disk."
    )
    path = (
        "Each dot is where the centre of the disk was seen in one frame, the line is the fitted path; the "
        "cross is the contact, and beyond the dashed circle the disk leaves the wheels."
        if disk
        else "Angular velocity against angle."
    )
    alike = "; the motion is chaotic, so the runs resemble the record in their shape, not point by point."
    free = " A free run starts where the record starts and then sees no more data" + (alike if disk else ".")
    moment = (
        "A closer look at one moment: at the line each model is let go"
        if not profile.forecast_end
        else f"The end of the record: each model was let go at T = {discovery.split:.1f} s"
    )
    closer = (
        f"{moment}, from its own best estimate of the state there, with the parameters fitted to all data. "
        "This is one example; the errors over many starts, on data held back from the fit, are below."
    )
    shown = parts(
        Paragraph(tables.measured(discovery)),
        Figure(movie, moving + (chaotic if disk else "")),
        Figure(figures.frames(one, film), overlay) if film is not None else None,
        Figure(figures.orbits(one), path + free),
        Figure(figures.forecast(one), closer),
    )
    return Section("What was measured", shown)


def errors_heading(discovery: Discovery) -> str:
    """Over the held-out errors."""
    if discovery.effects:
        return "The error, before and after"
    return "The error on data the model had not seen"


def errors_table(discovery: Discovery) -> Table:
    """Held-out errors at every horizon."""
    columns = {
        "horizon": Column("let go for", number=True, names=True),
        "before": Column(BEFORE, number=True),
        "after": Column("with what was added", number=True),
        "floor": Column("noise floor", number=True),
    }
    return table(errors_heading(discovery), columns_with(columns, discovery), tables.errors(discovery))


def columns_with(columns: dict[str, Column], discovery: Discovery) -> dict[str, Column]:
    """The columns without what there is only after something was added."""
    return {name: c for name, c in columns.items() if name != "after" or discovery.effects}


def held_back(discovery: Discovery) -> str:
    """Which data were held out."""
    m = discovery.measurement
    if discovery.held_out:
        return f"Whole records, by number {', '.join(map(str, discovery.held_out))},"
    return f"The last {100 * (1 - (discovery.split - m.t[0]) / m.duration):.0f} % of the record"


def _errors(discovery: Discovery) -> Section:
    proved = "; there the effect had to prove itself" if discovery.effects else ""
    said = (
        f"{held_back(discovery)} were held back. On them the model was let go at "
        f"{len(discovery.error_before.samples)} moments, each time from a state that the data just before it "
        f"show{proved}."
    )
    caption = (
        "Median error, with 95 % intervals. Dotted: the noise floor, which noise in the data and in the "
        "starting state alone would leave to a faultless model."
    )
    shown = parts(Paragraph(said), Figure(figures.errors(discovery), caption), errors_table(discovery))
    return Section(errors_heading(discovery), shown)


def _residuals(discovery: Discovery, surprises: Sequence[Innovations]) -> Section:
    loose = [loosest(discovery.baseline)]
    if discovery.effects:
        loose.append(loosest(discovery.fit))
    more = (
        "A frame marks where the known model leaves more than that: a pattern may spill over into equations "
        "that are right, but with the effect all should be gone."
        if discovery.effects
        else "A frame marks where it is more than that."
    )
    said = (
        "If a model is right, what each of its equations leaves over is noise about zero, whatever it is "
        f"drawn against. {more}"
    )
    colours = "; orange the known model, blue with the added effect" if discovery.effects else ""
    caption = (
        "Rows: the equations. Columns: what their residual is drawn against. Lines: means, with bands of two "
        f"standard errors{colours}. Each row has one scale, given on its left: how far the motion departs "
        "from the equation, in a fit that follows the data closely and leans little on the model. The errors "
        "count how long neighbouring frames go together."
    )
    clearest = "The clearest pattern, frame by frame (grey), with its means and two standard errors."
    shown = parts(
        Paragraph(said),
        Figure(figures.residual_map(loose), caption),
        Figure(figures.residuals(loose), clearest),
        whiteness(discovery, surprises),
    )
    return Section("Where the known model fails", shown)


def whiteness(discovery: Discovery, surprises: Sequence[Innovations]) -> tuple[Part, ...]:
    """Whether the innovations are white noise."""
    title = "Are the surprises white noise?"
    columns = {
        "name": Column("channel", names=True),
        "model": Column("model"),
        "square": Column("mean square", number=True),
        "largest": Column("largest autocorrelation", number=True),
        "p": Column("Ljung–Box: probability for white noise", number=True),
    }
    both = ", before and after" if discovery.effects else ""
    caption = (
        f"Autocorrelation of the innovations{both}. The grey band holds 95 % of the values of white noise."
    )
    said = (
        "A model that is right foretells each frame from those before it, up to white noise. What it did not "
        "foretell, the innovation, should have a mean square of 1 in units of what was expected, and no "
        "memory."
    )
    return (
        Subheading(title),
        Paragraph(said),
        Figure(figures.whiteness(surprises), caption),
        table(title, columns, tables.whiteness(surprises)),
    )


def tried_heading(discovery: Discovery) -> str:
    """Over the candidates."""
    return "What was added, and why" if discovery.effects else "What was tried"


def nearest(discovery: Discovery) -> tuple[Part, ...]:
    """What nearly passed."""
    sentences = wording.rejected(discovery)
    return (Paragraph("Nearest come:"), Bullets(tuple(map(pretty, sentences)))) if sentences else ()


def reasons(discovery: Discovery) -> tuple[Part, ...]:
    """Why each effect was added."""
    made = []
    for effect in discovery.effects:
        chance = Markup("{}").format(wording.probability(effect.p))
        text = Markup(
            "<strong>{}</strong>: χ² fell by {:.0f} when it was added; the probability of that by chance, "
            "all "
        ).format(pretty(effect.title), effect.chi2) + Markup("candidates counted, is {}. {}").format(
            chance, wording.confirmed_by(effect)
        )
        made.append(Paragraph(text))
    return tuple(made)


def _tried(discovery: Discovery) -> Section:
    smooth = (
        ", and so were smooth curves and surfaces in every equation" if tables.curves(discovery, 0) else ""
    )
    rule = (
        "One was added only if chance would hardly do as well (less than 0.1 % over all candidates "
        "together), if its numbers are physical, and if the data held back bear it out."
        if discovery.effects
        else "None passed: to be added, chance must hardly do as well (less than 0.1 % over all candidates "
        "together), the numbers must be physical, and the data held back must bear it out."
    )
    caption = (
        "What is missing, as a curve that the data alone draw, without a formula; the band holds it with 95 "
        "%. What the known model's own numbers could do just as well is taken out. Ticks or dots: where the "
        "record has been."
    )
    drawn = [Figure(figures.curve(f.curve), caption) for f in discovery.effects if f.curve is not None]
    rounds = [part for stage in range(len(discovery.scans)) for part in _round(discovery, stage)]
    said = Paragraph(f"Every effect of the library was tried{smooth}. {rule}")
    shown = parts(said, nearest(discovery), reasons(discovery), drawn, rounds)
    return Section(tried_heading(discovery), shown)


def round_heading(stage: int) -> str:
    """Over one round of the search."""
    return "After adding what was found" if stage else "First search"


def _round(discovery: Discovery, stage: int) -> tuple[Part, ...]:
    rows = tables.candidates(discovery, stage)
    columns = {
        "title": Column("candidate", names=True),
        "equation": Column("equation"),
        "chi2": Column("decrease in χ²", number=True),
        "estimate": Column("estimate"),
        "said": Column("remark"),
    }
    told = [{**row, "equation": pretty(row["equation"])} for row in rows]
    best = replace(
        table(f"{round_heading(stage)}: the best candidates", columns, told),
        summary="Table of the best candidates",
        open=stage == 0 and bool(discovery.effects),
        marked=frozenset(k for k, row in enumerate(rows) if row["said"] == "found"),
    )
    curves = [{**row, "title": pretty(row["title"])} for row in tables.curves(discovery, stage)]
    columns = {
        "title": Column("curve", names=True),
        "evidence": Column("odds over no curve", number=True),
        "p": Column("probability by chance, for it alone", number=True),
    }
    smooth = replace(
        table(f"{round_heading(stage)}: the best curves", columns, curves), summary="Table of the best curves"
    )
    caption = (
        "The longer the bar, the more the fit improves; the scale is logarithmic. The bar of the effect that "
        "was added shows by how much χ² decreased; the other bars, and the estimates in the table, are first "
        "ones, made around the model as it was."
    )
    bars = Figure(figures.evidence(discovery, stage), caption)
    return parts(Subheading(round_heading(stage)), bars, best, smooth if curves else None)


def others(discovery: Discovery) -> Section:
    """What the data cannot tell apart from what was found."""
    listed: list[Text] = []
    for other in discovery.alternatives:
        title = f"{other.title[0].upper()}{other.title[1:]}"
        instead = wording.title_of(discovery, other.instead_of)
        listed.append(
            Markup("<strong>{}</strong> ({}) instead of {}. {}").format(
                title, pretty(other.effect.expression), instead, wording.limit(other)
            )
        )
    none = "No other effect of the library explains these data as well."
    return others_of(discovery, tuple(listed) or (none,))


def others_of(discovery: Discovery, listed: tuple[Text, ...]) -> Section:
    """What else it could be, and what to film to tell."""
    hint = discovery.hint
    tell = Paragraph(Markup("To tell: {}.").format(pretty(hint.text))) if hint is not None else None
    return Section("What else it could be", parts(Bullets(listed), tell))


def _limits(discovery: Discovery) -> Section:
    return Section("What these data cannot say", (Bullets(tuple(wording.limits(discovery))),))


def _numbers(discovery: Discovery, one: Discovery) -> Section:
    columns = {
        "name": Column("symbol", names=True),
        "meaning": Column("what it is"),
        "before": Column(BEFORE, number=True),
        "after": Column(AFTER, number=True),
        "unit": Column("unit"),
    }
    columns = columns_with(columns, discovery)
    fixed = [
        {**row, "before": row["value"], "after": row["value"], "unit": row["unit"] + " (taken as known)"}
        for row in tables.fixed(discovery)
    ]
    bends = (
        " A model that lacks something bends them, as it bends the other numbers: compare the two columns."
        if discovery.effects
        else ""
    )
    camera = (
        "These were fitted along with the rest, so that a crooked or shifted camera does not pass for an "
        f"effect.{bends}"
    )
    noise = {
        "name": Column("symbol", names=True),
        "found": Column("standard deviation at rest", number=True),
        "growth": Column("grows with the speed by", number=True),
        "stated": Column(tables.noise_beforehand(discovery.fit), number=True),
    }
    fitted = "the added effect" if discovery.effects else "the known model"
    braking = "The friction coefficient k(Ω) that was found, with everything that brakes the rotation in it."
    shown = parts(
        Figure(figures.friction(discovery.fit), braking),
        table(
            "The numbers",
            columns,
            [*tables.parameters(discovery), *fixed],
            "Parameters of the model, with standard errors",
        ),
        Subheading("What the camera got wrong"),
        Paragraph(camera),
        table("What the camera got wrong", columns, tables.camera(discovery)),
        Subheading("The noise"),
        Figure(
            figures.misfits(one.fit),
            f"Measured less fitted, with {fitted}. The band holds 95 % of honest noise.",
        ),
        table("The noise", noise, tables.noise(discovery.fit)),
    )
    return Section("The numbers", shown)
