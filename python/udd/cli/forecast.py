"""`udd forecast`: what comes next, and how long that can be believed."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd._util.small_units import small_unit

from .export import add_out, checked, save_figure
from .fit import options
from .inputs import add_input, check_early, inputs_of
from .options import new
from .output import CommandResult, status_line

if TYPE_CHECKING:
    from udd.fitting.forecast import Forecast

_DATA = (".csv",)


def add(commands: Any) -> None:
    """Add the command."""
    summary = "Fit the model, filter the last second, and run free: a forecast with the fan of an ensemble."
    parser = new(
        commands,
        "forecast",
        run,
        summary,
        (
            "udd forecast disk.csv --start 20 --out fan.png",
            "udd forecast pendulum.csv --t 5 --members 50 --out fan.csv",
        ),
    )
    add_input(parser)
    parser.add_argument("--t", type=float, help="length of the forecast [s] (default 10; a pendulum 60)")
    parser.add_argument(
        "--start",
        type=float,
        help="time from which the model runs free [s]; later frames are only compared (default: the end)",
    )
    parser.add_argument(
        "--window",
        type=float,
        help="length of record before --start that determines the state there [s] (default 1; a pendulum 4)",
    )
    parser.add_argument("--members", type=int, default=200, help="size of the ensemble (default 200)")
    parser.add_argument("--level", type=float, default=0.95, help="share within the band (default 0.95)")
    parser.add_argument(
        "--error",
        type=float,
        help="error up to which the forecast is valid [m, or rad] (default 0.005; a pendulum 0.05)",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the ensemble (default 0)")
    add_out(parser, _DATA)


def run(args: argparse.Namespace) -> CommandResult:
    """Do it."""
    from udd.fitting import fit
    from udd.fitting.forecast import forecast

    check_early(args)
    checked(args.out, _DATA)
    given = inputs_of(args)
    measurement, model = given.measured
    record = measurement if args.start is None else measurement.rows(measurement.t <= args.start)
    with status_line() as tell:
        tell("fitting")
        fitted = fit(record, model, **options(args))
        tell("running the ensemble")
        prediction = forecast(
            measurement,
            fitted,
            args.t,
            start=args.start,
            window=args.window,
            members=args.members,
            level=args.level,
            error=args.error,
            rng=args.seed,
        )
    for path in args.out:
        _write(path, prediction)
    text = "\n".join([describe(prediction), *(f"written: {path}" for path in args.out)])
    return CommandResult(text, {**given.file_entry, **prediction.to_dict(), "files": args.out})


def describe(prediction: Forecast) -> str:
    """Describe a forecast in a few lines."""
    unit, factor = small_unit(prediction.fit.model.profile.sensor.error_unit)
    within = f"{factor * prediction.error:.3g} {unit}"
    reach = prediction.t[-1] - prediction.start
    lines = [
        f"forecast from T = {prediction.start:.5g} s for {reach:.4g} s, {len(prediction.members)} members"
    ]
    if math.isfinite(prediction.valid_time):
        latest = (
            f"{prediction.valid_high:.3g}" if math.isfinite(prediction.valid_high) else f"over {reach:.3g}"
        )
        lines.append(
            f"  valid to {within} for {prediction.valid_time:.3g} s "
            f"({100 * prediction.level:g} % of the members: {prediction.valid_low:.3g} to {latest} s)"
        )
    else:
        lines.append(f"  valid to {within} until the end of the forecast")
    if math.isfinite(prediction.lyapunov_time):
        times = (
            f"; valid for {prediction.lyapunov_times:.2g} of them"
            if math.isfinite(prediction.valid_time)
            else ""
        )
        lines.append(f"  Lyapunov time of the fitted model: {prediction.lyapunov_time:.3g} s{times}")
    elif math.isinf(prediction.lyapunov_time):
        lines.append("  errors of the fitted model do not grow in the long run")
    if math.isfinite(prediction.measured_valid_time):
        lines.append(f"  the measurement parted from the median after {prediction.measured_valid_time:.3g} s")
    return "\n".join(lines)


def _write(path: Path, prediction: Forecast) -> None:
    from udd._util.atomic_files import write_whole

    if path.suffix == ".csv":
        write_whole(path, _csv(prediction).encode())
        return
    from matplotlib.figure import Figure

    from udd.plot import forecast as draw

    figure = Figure(figsize=(9.0, 2.6 * len(prediction.names) + 0.4), layout="constrained")
    axes = figure.subplots(len(prediction.names), 1, sharex=True, squeeze=False)[:, 0]
    for ax, name in zip(axes, prediction.names, strict=True):
        draw(prediction, ax, coordinate=name)
        if ax is not axes[0]:
            ax.get_legend().remove()
        if ax is not axes[-1]:
            ax.set_xlabel("")
    save_figure(path, figure)


def _csv(prediction: Forecast) -> str:
    """Return the curves as text: t, then median, low and high of each channel."""
    head = ["t", *(f"{name}{end}" for name in prediction.names for end in ("", "_low", "_high"))]
    rows = [",".join(head)]
    for k, t in enumerate(prediction.t.tolist()):
        cells = [t]
        for m in range(len(prediction.names)):
            cells += [
                float(prediction.median[k, m]),
                float(prediction.low[k, m]),
                float(prediction.high[k, m]),
            ]
        rows.append(",".join(map(repr, cells)))
    return "\n".join(rows) + "\n"
