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

#: Column headings for the known model and for the model with the added effect.
BEFORE, AFTER = "known model", "with the effect"


def head(discovery: Discovery, kicker: str, said: Iterable[Paragraph], unit: str = "") -> Head:
    """Build the head: the verdict, the added effect, and the held-out errors with their `unit`."""
    numbers = wording.headline(discovery)
    if believed := belief(discovery.by_record):
        said = [Paragraph(believed), *said]
    shown = [
        Number(
            f"error of the known model {numbers.span}, on data it had not seen{unit}",
            numbers.before,
            numbers.before_note,
            style="before",
        )
    ]
    if discovery.effects:
        interval = f"95 % interval {numbers.interval}"
        shown += [
            Number("with the added effect", numbers.after, numbers.after_note, style="after"),
            Number("error after over before", numbers.ratio, interval),
        ]
    floor = f"noise floor after {numbers.floor_at}: the error of a faultless model"
    notes = [Paragraph(f"Noise of one frame: {wording.noise(discovery)}.")]
    if origin := discovery.measurement.meta.get("origin"):
        notes.insert(0, Paragraph(str(origin)))
    notes += [Paragraph(remark, "warn") for remark in discovery.remarks]
    if not discovery.fit.converged:
        settled = "The fit did not converge: no model that was tried fits these data."
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
    """Build the head for a disk or a pendulum."""
    thing = discovery.fit.model.profile.shown.noun
    said = [Paragraph(_formula(effect, discovery), "formula") for effect in discovery.effects]
    said += [Paragraph(pretty(sentence)) for sentence in wording.short_limits(discovery)]
    return head(discovery, f"Effects that the model of the {thing} lacks", said)


def _formula(added: AddedEffect, discovery: Discovery) -> Markup:
    effect = added.effect
    changed = [pretty(equation) + Markup(", &ensp;") for equation in wording.enters(effect)]
    values = Markup("")
    if not wording.is_spline(effect):
        values = Markup(" &ensp;with ") + wording.values_of(added, discovery.fit.model.units)
    return Markup("").join(changed) + pretty(added.equation) + values


def sections(
    discovery: Discovery, film: str | os.PathLike[str] | None, surprises: Sequence[Innovations]
) -> tuple[Section, ...]:
    """Build the sections on motion, errors, residuals, candidates, limits and numbers."""
    # If several films were fitted together, the first one is shown.
    first_record = replace(discovery, baseline=first_film(discovery.baseline), fit=first_film(discovery.fit))
    if not discovery.fit.model.profile.shown.contact:
        film = None  # the motion is drawn: only a disk is drawn over frames
    made = [_measured(discovery, first_record, film), _errors(discovery), _residuals(discovery, surprises)]
    if not discovery.effects:
        return (*made, _tried(discovery), _limits(discovery), _numbers(discovery, first_record))
    return (
        *made,
        _tried(discovery),
        others(discovery),
        _limits(discovery),
        _numbers(discovery, first_record),
    )


def _measured(discovery: Discovery, first_record: Discovery, film: str | os.PathLike[str] | None) -> Section:
    profile = discovery.fit.model.profile.shown
    disk = profile.contact
    movie = animation.side_by_side(first_record, film)
    moving = (
        f"{'The film' if movie.filmed else 'The measured motion'} next to the models, at half its speed. The "
        f"held-out data begin at T = {movie.start:.1f} s. There each model starts from its own best estimate "
        "of the state and runs without further data. "
    )
    chaotic = "The motion is chaotic: every model leaves it sooner or later, the best one last."
    overlay = (
        "Frames of the film. Light blue: the fitted disk and its centre. Rings: the expected places of its "
        "four marks. Cross: the contact between the wheels and the disk."
    )
    path = (
        "Dots: the measured centre of the disk in each frame. Line: the fitted path. Cross: the contact. "
        "Beyond the dashed circle the disk leaves the wheels."
        if disk
        else "Angular velocity against angle."
    )
    alike = "; the motion is chaotic, so the runs resemble the record in their shape, not point by point."
    free = " A free run starts at the start of the record and uses no further data" + (alike if disk else ".")
    moment = (
        "A closer look at one moment: each model starts at the line"
        if not profile.forecast_end
        else f"The end of the record: each model starts at T = {discovery.split:.1f} s"
    )
    closer = (
        f"{moment}, from its own best estimate of the state there, with the parameters fitted to all data. "
        "This is one example; the errors over many starts, on held-out data, are below."
    )
    shown = parts(
        Paragraph(tables.measured(discovery)),
        Figure(movie, moving + (chaotic if disk else "")),
        Figure(figures.frames(first_record, film), overlay) if film is not None else None,
        Figure(figures.orbits(first_record), path + free),
        Figure(figures.forecast(first_record), closer),
    )
    return Section("The measured motion", shown)


def errors_heading(discovery: Discovery) -> str:
    """Over the held-out errors."""
    if discovery.effects:
        return "The error, before and after"
    return "The error on data the model had not seen"


def errors_table(discovery: Discovery) -> Table:
    """Held-out errors at every horizon."""
    columns = {
        "horizon": Column("forecast horizon", number=True, names=True),
        "before": Column(BEFORE, number=True),
        "after": Column(AFTER, number=True),
        "floor": Column("noise floor", number=True),
    }
    return table(errors_heading(discovery), columns_with(columns, discovery), tables.errors(discovery))


def columns_with(columns: dict[str, Column], discovery: Discovery) -> dict[str, Column]:
    """Return the columns; that for an added effect only if an effect was added."""
    return {name: c for name, c in columns.items() if name != "after" or discovery.effects}


def held_back(discovery: Discovery) -> str:
    """Name the held-out data."""
    m = discovery.measurement
    if discovery.held_out:
        return f"Whole records, by number {', '.join(map(str, discovery.held_out))},"
    begin, end = discovery.held_out_span
    which = "first" if begin < discovery.trained.record.clock[0] else "last"
    return f"The {which} {100 * (end - begin) / m.duration:.0f} % of the record"


def _errors(discovery: Discovery) -> Section:
    proved = "; the effect had to pass this test" if discovery.effects else ""
    said = (
        f"{held_back(discovery)} were not used for the fit. On them the model was run from "
        f"{len(discovery.error_before.samples)} moments, each time from the state that the preceding data "
        f"give{proved}."
    )
    caption = (
        "Median error, with 95 % intervals. Dotted: the noise floor, the error of a faultless model due to "
        "noise in the data and in the starting state."
    )
    shown = parts(Paragraph(said), Figure(figures.errors(discovery), caption), errors_table(discovery))
    return Section(errors_heading(discovery), shown)


def _residuals(discovery: Discovery, surprises: Sequence[Innovations]) -> Section:
    loose = [loosest(discovery.baseline)]
    if discovery.effects:
        loose.append(loosest(discovery.fit))
    remark = (
        "A frame marks larger residuals of the known model. A pattern may also show in equations that are "
        "right, but with the effect all patterns should be gone."
        if discovery.effects
        else "A frame marks larger residuals."
    )
    said = (
        "If a model is right, the residual of each equation is noise about zero along every coordinate. "
        f"{remark}"
    )
    colours = "; orange the known model, blue with the added effect" if discovery.effects else ""
    caption = (
        "Rows: the equations. Columns: the coordinates. Lines: mean residuals, with bands of two "
        f"standard errors{colours}. Each row has one scale, given on its left. The residual is the departure "
        "of the motion from the equation, in a fit that follows the data closely and weights the model "
        "little. The standard errors take the correlation of neighbouring frames into account."
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
    """Build the test of the innovations for white noise."""
    title = "Are the innovations white noise?"
    columns = {
        "name": Column("channel", names=True),
        "model": Column("model"),
        "square": Column("mean square", number=True),
        "largest": Column("largest autocorrelation", number=True),
        "p": Column("Ljung–Box: probability for white noise", number=True),
    }
    remark = ", before and after" if discovery.effects else ""
    caption = (
        f"Autocorrelation of the innovations{remark}. The grey band holds 95 % of the values of white noise."
    )
    said = (
        "A right model predicts each frame from the earlier ones, up to white noise. The innovation is the "
        "frame minus its prediction. In units of its expected standard deviation its mean square should be "
        "1, and its autocorrelation 0."
    )
    return (
        Subheading(title),
        Paragraph(said),
        Figure(figures.whiteness(surprises), caption),
        table(title, columns, tables.whiteness(surprises)),
    )


def tried_heading(discovery: Discovery) -> str:
    """Return the heading over the candidates."""
    return "The added effect, and why" if discovery.effects else "The candidates"


def nearest(discovery: Discovery) -> tuple[Part, ...]:
    """List the candidates that nearly passed."""
    sentences = wording.rejected(discovery)
    return (Paragraph("The nearest candidates:"), Bullets(tuple(map(pretty, sentences)))) if sentences else ()


def reasons(discovery: Discovery) -> tuple[Part, ...]:
    """Give the reasons for each added effect."""
    made = []
    for effect in discovery.effects:
        chance = Markup("{}").format(wording.probability(effect.p))
        text = Markup(
            "<strong>{}</strong>: it decreased χ² by {:.0f}; the probability of that by chance, over all "
        ).format(pretty(effect.title), effect.chi2) + Markup("candidates, is {}. {}").format(
            chance, wording.confirmed_by(effect)
        )
        made.append(Paragraph(text))
    return tuple(made)


def _tried(discovery: Discovery) -> Section:
    smooth = (
        ", and so were smooth curves and surfaces in every equation" if tables.curves(discovery, 0) else ""
    )
    rule = (
        "A candidate was added only if chance would rarely do as well (less than 0.1 % over all candidates "
        "together), if its parameters are physical, and if the held-out data confirm it."
        if discovery.effects
        else "None passed: chance must rarely do as well (less than 0.1 % over all candidates together), "
        "the parameters must be physical, and the held-out data must confirm the candidate."
    )
    caption = (
        "The missing term as a curve, estimated from the data without a formula, with its 95 % band. "
        "The part that the known model's parameters could absorb is removed. Ticks or dots: places that the "
        "record visits."
    )
    drawn = [Figure(figures.curve(f.curve), caption) for f in discovery.effects if f.curve is not None]
    rounds = [part for stage in range(len(discovery.scans)) for part in _round(discovery, stage)]
    said = Paragraph(f"Every effect of the library was tried{smooth}. {rule}")
    shown = parts(said, nearest(discovery), reasons(discovery), drawn, rounds)
    return Section(tried_heading(discovery), shown)


def round_heading(stage: int) -> str:
    """Return the heading over one round of the search."""
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
    cells = [{**row, "equation": pretty(row["equation"])} for row in rows]
    best = replace(
        table(f"{round_heading(stage)}: the best candidates", columns, cells),
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
        "The longer the bar, the more the fit improves; the scale is logarithmic. The bars of the added "
        "effect, and of effects that act identically, show the decrease in χ² of the full fit. The other "
        "bars, and the estimates in the table, are first estimates from the fit before."
    )
    bars = Figure(figures.evidence(discovery, stage), caption)
    return parts(Subheading(round_heading(stage)), bars, best, smooth if curves else None)


def others(discovery: Discovery) -> Section:
    """List the effects that these data cannot distinguish from the added one."""
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
    """Build the section of alternatives, with the film that would decide."""
    hint = discovery.hint
    tell = Paragraph(Markup("To decide: {}.").format(pretty(hint.text))) if hint is not None else None
    return Section("Alternatives", parts(Bullets(listed), tell))


def _limits(discovery: Discovery) -> Section:
    return Section("Limits of these data", (Bullets(tuple(wording.limits(discovery))),))


def _numbers(discovery: Discovery, first_record: Discovery) -> Section:
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
        " A missing effect distorts them, as it distorts the other parameters: compare the two columns."
        if discovery.effects
        else ""
    )
    camera = (
        "These were fitted with the rest, so that a tilted or shifted camera is not mistaken for an "
        f"effect.{bends}"
    )
    noise = {
        "name": Column("symbol", names=True),
        "found": Column("standard deviation at rest", number=True),
        "growth": Column("grows with the speed by", number=True),
        "stated": Column(tables.noise_beforehand(discovery.fit), number=True),
    }
    fitted = "the added effect" if discovery.effects else "the known model"
    braking = "The fitted friction coefficient k(Ω), including all effects that brake the rotation."
    shown = parts(
        Figure(figures.friction(discovery.fit), braking),
        table(
            "The numbers",
            columns,
            [*tables.parameters(discovery), *fixed],
            "Parameters of the model, with standard errors",
        ),
        Subheading("Faults of the camera"),
        Paragraph(camera),
        table("Faults of the camera", columns, tables.camera(discovery)),
        Subheading("The noise"),
        Figure(
            figures.misfits(first_record.fit),
            f"Measured less fitted, with {fitted}. The band holds 95 % of the noise.",
        ),
        table("The noise", noise, tables.noise(discovery.fit)),
    )
    return Section("The numbers", shown)
