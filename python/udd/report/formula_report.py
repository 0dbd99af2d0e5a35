"""The report of a search for what a user's own model lacks: its states and its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from udd.fitting import eased
from udd.models.formula_model import FormulaModel
from udd.plot.style import AFTER as ADDED
from udd.plot.style import BEFORE as KNOWN
from udd.plot.style import MEASURED, tidy

from . import figures, wording
from .discovery_report import (
    BEFORE,
    columns_with,
    errors_heading,
    errors_table,
    head,
    held_back,
    nearest,
    others_of,
    reasons,
    round_heading,
    tried_heading,
    whiteness,
)
from .document import (
    Column,
    Figure,
    Head,
    Image,
    Paragraph,
    Part,
    Section,
    Subheading,
    Text,
    parts,
    table,
)
from .images import blank, png, svg
from .runs import side_by_side

if TYPE_CHECKING:
    from udd.discovery.results import Discovery
    from udd.fitting import Fit
    from udd.fitting.innovations import Innovations

_SHOWN = 8.0  # longest horizons of the held-out errors that the free runs are shown for


def formula_head(discovery: Discovery) -> Head:
    """Build the head."""
    said = []
    for added in discovery.effects:
        values = Markup("")
        if not wording.is_spline(added.effect):
            values = Markup(" &ensp;with ") + wording.values_of(added, {})
        said.append(Paragraph(Markup("{}").format(added.equation) + values, "formula"))
    return head(discovery, "Effects that the model lacks", said, ", in units of the motion's spread")


def sections(discovery: Discovery, surprises: Sequence[Innovations]) -> tuple[Section, ...]:
    """Build the sections on motion, model, errors, candidates, innovations and numbers."""
    made = [_measured(discovery), _model(discovery), _errors(discovery), _tried(discovery)]
    if discovery.effects:
        made.append(others(discovery))
    made.append(Section("The innovations", whiteness(discovery, surprises)))
    return (*made, _numbers(discovery))


def _measured(discovery: Discovery) -> Section:
    caption = (
        "At the start of the held-out data each model starts from its own best estimate of the state and "
        "runs without further data."
    )
    shown = (Paragraph(measured(discovery)), Figure(_free_runs(discovery), caption))
    return Section("The measured motion", shown)


def _model(discovery: Discovery) -> Section:
    shown = tuple(Paragraph(equation, "formula") for equation in equations(discovery))
    return Section("The known model", shown)


def _errors(discovery: Discovery) -> Section:
    caption = (
        f"Median error over {len(discovery.error_before.samples)} starts, with 95 % intervals. Dotted: the "
        "noise floor, the error of a faultless model due to noise in the data and in the starting state."
    )
    note = Paragraph(f"{held_back(discovery)} were not used for the fit.") if discovery.held_out else None
    shown = parts(note, Figure(figures.errors(discovery), caption), errors_table(discovery))
    return Section(errors_heading(discovery), shown)


def _tried(discovery: Discovery) -> Section:
    rule = (
        "A candidate was added only if chance would rarely do as well (less than 0.1 % over all of them "
        "together), and if the held-out data confirm it."
        if discovery.effects
        else "None passed: chance must rarely do as well (less than 0.1 % over all of them together), and "
        "the held-out data must confirm the candidate."
    )
    said = (
        "Terms made of the states were tried in every equation, and so were waves of every frequency, smooth "
        f"curves and surfaces. {rule}"
    )
    caption = "The missing term as a curve, estimated from the data without a formula, with its 95 % band."
    drawn = [
        Figure(figures.curve(f.curve), caption)
        for f in discovery.effects
        if f.curve is not None and wording.is_spline(f.effect)
    ]
    bars = "The longer the bar, the more the fit would improve; the scale is logarithmic."
    rounds: list[Part] = []
    for stage in range(len(discovery.scans)):
        rounds += [Subheading(round_heading(stage)), Figure(figures.evidence(discovery, stage), bars)]
    shown = parts(Paragraph(said), nearest(discovery), reasons(discovery), drawn, rounds)
    return Section(tried_heading(discovery), shown)


def others(discovery: Discovery) -> Section:
    """List the terms that these data cannot distinguish from the added one."""
    listed: list[Text] = [
        Markup(
            "<strong>{}</strong> ({}) instead of {}: worse by {:.1f} units of log-likelihood; a form is "
            "excluded from 10 on."
        ).format(
            other.title, other.effect.expression, wording.title_of(discovery, other.instead_of), other.nats
        )
        for other in discovery.alternatives
    ]
    none = "Nothing else that was tried explains these data as well."
    return others_of(discovery, tuple(listed) or (none,))


def _numbers(discovery: Discovery) -> Section:
    columns = {
        "name": Column("symbol", names=True),
        "before": Column(BEFORE, number=True),
        "after": Column("with the added effect", number=True),
    }
    caption = "Parameters, with standard errors"
    shown = (
        table("The numbers", columns_with(columns, discovery), parameters(discovery), caption),
        Figure(_misfits(discovery.fit), "Measured less fitted. The band holds 95 % of the noise."),
    )
    return Section("The numbers", shown)


def parameters(discovery: Discovery) -> list[dict[str, Text]]:
    """List every free parameter, before and after."""
    baseline = discovery.baseline
    if discovery.effects:
        # These are the errors of `udd fit`. The search's own ones do not contain what the model lacks.
        baseline = eased(baseline).with_diagnostics()
    rows: list[dict[str, Text]] = []
    for name in discovery.fit.parameters:
        before, after = (
            wording.with_error(fit.parameters[name], fit.errors[name]) if name in fit.parameters else "–"
            for fit in (baseline, discovery.fit)
        )
        rows.append({"name": _symbol(name, discovery), "before": before, "after": after})
    return rows


def _symbol(name: str, discovery: Discovery) -> Text:
    """Return a parameter's name; of an effect's parameter its letter and the effect's title."""
    effect, dot, letter = name.partition(".")
    return f"{letter} of {wording.title_of(discovery, effect)}" if dot else name


def equations(discovery: Discovery) -> list[str]:
    """List the equations of the known model."""
    model = discovery.baseline.model
    assert isinstance(model, FormulaModel)
    late = dict(model.delays)
    seen = [
        f"measured {name} = {text}" + (f", late by {late[name]}" if name in late else "")
        for name, text in model.observe
    ]
    return [f"{name}' = {text}" for name, text in model.equations.items()] + seen


def measured(discovery: Discovery) -> str:
    """Describe the measured data in a sentence."""
    m, fit = discovery.measurement, discovery.fit
    sd = np.median(fit.noise.sd(fit.record, fit.states[:, 0]), axis=0)
    seen = [(name, s) for name, s in zip(fit.channels, sd, strict=True) if np.isfinite(s)]
    noise = ", ".join(f"{s:.2g} in {name}" for name, s in seen)
    assert isinstance(fit.model, FormulaModel)
    hidden = [name for name in fit.channels if name not in m.names]
    if fit.model.observe:
        hidden = [f"{name} = {text}" for name, text in fit.model.observe if name not in m.names]
    what = f"{', '.join(m.names)} in {len(m)} frames over {m.duration:.4g} s"
    rest = f" Not measured: {', '.join(hidden)}." if hidden else ""
    return f"{what}; noise estimated from the record: {noise}.{rest}"


def _free_runs(discovery: Discovery) -> Image:
    names = [name for name in discovery.fit.channels if name in discovery.measurement.names]
    t, seen, modelled = side_by_side(discovery, _SHOWN * discovery.error_before.horizons[-1])
    figure, grid = blank(9.0, 1.7 * len(names) + 0.9, rows=len(names), top=0.4)
    said = (("the known model", KNOWN), ("with the added effect", ADDED))
    for (ax,), name in zip(grid, names, strict=True):
        k = discovery.fit.channels.index(name)
        ax.plot(t, seen[:, k], ".", color=MEASURED, markersize=3, label="measured")
        for values, (label, colour) in zip(modelled, said, strict=False):
            ax.plot(t, values[:, k], color=colour, linewidth=1.4, label=label)
        low, high = np.nanmin(seen[:, k]), np.nanmax(seen[:, k])
        ax.set_ylim(low - 0.3 * (high - low), high + 0.3 * (high - low))
        ax.set_ylabel(name)
        tidy(ax)
    grid[-1][0].set_xlabel("t")
    grid[0][0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    return svg(figure, "The states over time: measured, and free runs of the models")


def _misfits(fit: Fit) -> Image:
    names = [name for name in fit.channels if name in fit.measurement.names]
    figure, grid = blank(9.0, 1.5 * len(names) + 0.7, rows=len(names))
    sd = fit.noise.sd(fit.record, fit.states[:, 0])
    for (ax,), name in zip(grid, names, strict=True):
        k = fit.channels.index(name)
        ax.plot(fit.record.clock, fit.misfit[:, k], ".", color=MEASURED, markersize=2)
        band = 1.96 * float(np.median(sd[np.isfinite(sd[:, k]), k]))
        ax.axhspan(-band, band, color=ADDED, alpha=0.15)
        ax.set_ylabel(name)
        tidy(ax)
    grid[-1][0].set_xlabel("t")
    return png(figure, "Measured less fitted, with a band for the noise that was found")
