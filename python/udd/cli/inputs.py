"""A measurement from a file or a film, and the model that the options and its header describe."""

from __future__ import annotations

import argparse
import shlex
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from udd.errors import UddError

from .option_names import OPTIONS
from .options import add_disk, add_pendulum, disk, effects, given, names, pendulum, refuse_others
from .output import shown_progress
from .refused_film import explained
from .span import add_span, part_of

if TYPE_CHECKING:
    from udd.measurement import Measurement
    from udd.models import Model, Pendulum
    from udd.models.formula_model import FormulaModel

_FILMS = {".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".wmv", ".mts", ".3gp"}
_FILMS |= {".m2ts", ".ts", ".ogv", ".flv", ".h264", ".dv"}
#: Bytes at a film's beginning, and where they stand: MP4 and QuickTime, Matroska, AVI, MPEG, ASF, Ogg, Flash.
_SIGNATURES = (
    *((4, box) for box in (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")),
    *(
        (0, mark)
        for mark in (b"\x1a\x45\xdf\xa3", b"\0\0\1", b"\0\0\0\1", b"\x30\x26\xb2\x75", b"OggS", b"FLV\1")
    ),
    (8, b"AVI "),
)
_SHORTEST, _LONGEST = 1e-3, 100.0  # m, between which a length by the file is one of a pendulum
_CUT = 0.01  # share of the promised frames that may be missing


def add_input(parser: argparse.ArgumentParser, *, several: bool = False) -> None:
    """Add options for a file, or several of one device, and its constants."""
    parser.add_argument(
        "files",
        metavar="FILE",
        nargs="+" if several else 1,
        type=Path,
        help="a film, or a measurement (a table as text, CSV from Excel, or a file of phyphox, Tracker, "
        "MATLAB, NumPy, HDF5 or Parquet: t,Y,Z,beta or t,theta, or t and your model's states)",
    )
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FILE",
        help='a model of your own, as JSON or TOML: {"states": ["x", "v"], "equations": {"x": "v", "v": '
        '"-k*x"}, "parameters": {"k": 1.0}, "angles": []}; or, of a mechanism M q\'\' = f, {"mechanism": '
        '{"coordinates": {"x": "v"}, "mass": [["m"]], "forces": ["-k*x"]}, "parameters": {"m": 2.0, "k": '
        '1.0}}; "state0": {"v": 0.1} next to them gives the start of an unobserved state',
    )
    add_disk(parser, "drive speed [m/s]; 0 if the wheels stand still (overrides the file's header)")
    add_pendulum(parser, "pivot to centre of mass [m] (overrides the file's header)")
    parser.add_argument(
        OPTIONS["columns"],
        dest="columns",
        help='which column is what, such as "theta=position,t=Time (ms)", or the names of the columns of a '
        'file without a header, such as "t,theta,_" (_: passed over)',
    )
    parser.add_argument(
        OPTIONS["inputs"],
        dest="inputs",
        metavar="NAMES",
        help='columns of the inputs that drive the machine, such as "torque" or "u=Motor torque (N m)"',
    )
    parser.add_argument(
        "--gyroscope",
        nargs="?",
        const="",
        metavar="COLUMN",
        help="the column with the pendulum's rate of turning (default: the column in rad/s or deg/s that "
        "varies most); a table without an angle is read this way without the option, too",
    )
    parser.add_argument(
        OPTIONS["rate"],
        dest="sampling",
        type=float,
        metavar="HZ",
        help="samples per second, for a file without a column of times",
    )
    parser.add_argument(
        OPTIONS["repeated"],
        dest="repeated",
        choices=["first"],
        help="keep the first of several rows with the same time (default: refuse them)",
    )
    parser.add_argument(
        OPTIONS["part"],
        dest="part",
        type=int,
        metavar="N",
        help="if the clock jumps back, the file holds several runs: the run to read (the first is 0)",
    )
    parser.add_argument(
        OPTIONS["limit"],
        dest="limit",
        type=float,
        metavar="BYTES",
        help="bytes that a table may unpack to (default: 1e9); larger ones are refused",
    )
    add_span(parser)
    add_partial(parser)
    if several:
        parser.add_argument(
            "--each",
            metavar="NAMES",
            help="with several files: the parameters with a separate value for each file (default: W)",
        )
    parser.add_argument(
        "--free",
        action="append",
        metavar="NAMES",
        help="the model's free parameters, such as k0,W; repeatable (default: of a disk k0, k1, k2, W and "
        "effects, of a pendulum k0, length, inertia and effects, of a model of your own all)",
    )
    parser.add_argument("--no-camera", action="store_true", help="fit no fault of the camera")


def is_film(path: Path) -> bool:
    """Return True if a file is a film, by its name or else its first bytes; others are tables."""
    if path.suffix.lower() in _FILMS:
        return True
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            start = file.read(4096)
    except OSError:
        return False  # the reader of tables says what is wrong
    # MPEG's transport stream: packets that begin with G, of 188 bytes, or of 192 after a time.
    packets = b"GGGG" in (start[::188][:4], start[4::192][:4])
    return b"\0" in start and (packets or any(start.startswith(mark, at) for at, mark in _SIGNATURES))


@dataclass(frozen=True)
class Inputs:
    """The contents of the files: measurements, models with the values of their headers, and films."""

    files: list[Path]
    measurements: list[Measurement]
    models: list[Model]
    films: list[Path | None]

    @property
    def measured(self) -> tuple[Any, Any]:
        """The arguments of `udd.fit`: a measurement and its model, or lists of them."""
        if len(self.files) == 1:
            return self.measurements[0], self.models[0]
        return self.measurements, self.models

    @property
    def file_entry(self) -> dict[str, Any]:
        """The files in the output of `--json`."""
        return {"file": self.files[0] if len(self.files) == 1 else self.files}


def inputs_of(args: argparse.Namespace) -> Inputs:
    """Read the files; films are tracked."""
    measurements, models, films = [], [], []
    for options in _each(args):
        measurement, film = measurement_of(options)
        measurement = part_of(options, measurement)
        measurements.append(measurement)
        models.append(model_of(options, measurement))
        films.append(film)
    return Inputs(args.files, measurements, models, films)


def _each(args: argparse.Namespace) -> list[argparse.Namespace]:
    """Yield the same options for each file."""
    return [argparse.Namespace(**{**vars(args), "file": file}) for file in args.files]


def measurement_of(args: argparse.Namespace) -> tuple[Measurement, Path | None]:
    """Read the measurement in a file, and return the film if it is one."""
    constants = {"W": args.W, "R": args.R}
    if not is_film(args.file):
        from udd.measurement import read_measurement
        from udd.measurement.read import column_sentence, columns_of

        states, inputs = None, args.inputs
        limit = {} if args.limit is None else {"limit": args.limit}
        if args.model is None and _is_gyroscope(args, limit):
            return _gyroscope(args, limit), None
        if args.model is not None:
            there = columns_of(args.file, args.columns, **limit)
            model = own_model(args)
            states = [name for name in model.channels if name in there]
            if not states:
                what = "sensor" if model.observe else "state"
                raise UddError(
                    f"{args.file} has columns {', '.join(there)}, none of which is a {what} of {args.model}: "
                    f"{', '.join(model.channels)}"
                )
            if inputs is None:
                inputs = [name for name in model.inputs if name in there]
        with warnings.catch_warnings():
            # The line below says of every column which unit became which.
            warnings.filterwarnings("ignore", r".*: converted .*, as its columns say$")
            measurement = read_measurement(
                args.file,
                args.columns,
                states,
                inputs=inputs,
                rate=args.sampling,
                repeated=args.repeated,
                part=args.part,
                **limit,
                **constants,
            )
        if said := column_sentence(measurement.meta.get("columns")):
            print(f"udd: {args.file}: {said}", file=sys.stderr)
        return measurement, None
    if args.pendulum is not None:
        raise UddError(
            "a pendulum's film is tracked first (udd track --bob): --pendulum takes a table with t,theta"
        )
    from udd.tracking import track

    radius = 0.08 if args.R is None else args.R
    sizes = {} if args.R is None else {"disk_radius": args.R}
    with explained(args.file, sizes, shlex.join(["udd", *sys.argv[1:]])):
        tracked = whole(args, lambda: track(args.file, disk_radius=radius, progress=shown_progress()))
    return tracked.with_meta(
        **{key: value for key, value in constants.items() if value is not None}
    ), args.file


def _is_gyroscope(args: argparse.Namespace, limit: dict[str, float]) -> bool:
    """Return True if a table is a gyroscope's: an option says so, or it has rates of turning alone."""
    from udd.measurement.gyroscope import holds_rates_alone

    if args.gyroscope is not None:
        return True
    return args.columns is None and holds_rates_alone(args.file, **limit)


def _gyroscope(args: argparse.Namespace, limit: dict[str, float]) -> Measurement:
    from udd.measurement.gyroscope import read_gyroscope

    options = {"rate": args.sampling, "repeated": args.repeated, "part": args.part}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".*: converted .*, as its columns say$")
        record = read_gyroscope(args.file, args.gyroscope or None, **limit, **options)
    print(f"udd: {args.file}: read Omega from {record.meta['gyroscope']}", file=sys.stderr)
    return record


def add_partial(parser: argparse.ArgumentParser) -> None:
    """Add the option for a truncated film."""
    parser.add_argument("--partial", action="store_true", help="use the first part of a truncated film")


def whole(args: argparse.Namespace, measure: Callable[[], Measurement]) -> Measurement:
    """Measure a film; refuse a truncated one without `--partial`."""
    with warnings.catch_warnings(record=True) as said:
        measurement = measure()
    missing = int(measurement.meta.get("frames_missing", 0))
    promised = missing + len(measurement)
    if missing > _CUT * promised and not args.partial:
        raise UddError(
            f"{args.file} is cut off: {missing} of its {promised} frames are missing "
            "(--partial uses what there is)"
        )
    for warning in said:
        warnings.warn(warning.message, stacklevel=2)
    return measurement


def model_of(args: argparse.Namespace, measurement: Measurement) -> Model:
    """Make the known model; the command line takes precedence over the measurement's header."""
    if args.model is not None:
        return own_model(args)
    if measurement.kind == "pendulum":
        return _pendulum(args, measurement)
    if measurement.names == ("Omega",):
        if args.effect:
            raise UddError("--effect does not apply to a gyroscope's record: say the law with --model")
        return _pendulum(args, measurement).with_gyroscope()
    if measurement.kind != "disk":
        columns = (
            f"column {measurement.names[0]} is"
            if len(measurement.names) == 1
            else (f"columns {', '.join(measurement.names)} are")
        )
        raise UddError(
            f"{args.file}: the {columns} no pendulum's (theta) and no disk's (Y, Z, beta): use --model"
        )
    refuse_others(args, "disk", f"{args.file} is a disk's record: ")
    W = _option_or_header(args, measurement, "W")
    if W is None:
        raise UddError(
            f"the drive speed is in neither the command line nor the header of {args.file}: "
            "say --W in m/s (--W 0 if the wheels stand still)"
        )
    R = _option_or_header(args, measurement, "R")
    return disk(args, W, 0.08 if R is None else R)


def _pendulum(args: argparse.Namespace, measurement: Measurement) -> Pendulum:
    """Make a pendulum; without --pendulum its size comes from the header."""
    of_bob = "atan2(x, -y)" in str(measurement.meta.get("columns"))
    hint = ', from x and y (of a disk say --columns "Y=...,Z=...,beta=...")' if of_bob else ""
    refuse_others(args, "pendulum", f"{args.file} is a pendulum's record{hint}: ")
    length, inertia = args.pendulum, args.inertia
    if length is None:
        length = _number(args, measurement, "length")
        if length is not None and not _SHORTEST < length < _LONGEST:
            length = None  # of a bob in pixels, perhaps
        inertia = _number(args, measurement, "inertia") if inertia is None else inertia
        if length is not None:
            print(f"udd: {args.file}: the pendulum's length is {length:.4g} m by the file", file=sys.stderr)
    if length is None:
        raise UddError(f"{args.file} is a pendulum's record: say its length in m with --pendulum LENGTH")
    return pendulum(args, length, inertia)


def own_model(args: argparse.Namespace) -> FormulaModel:
    """Make the user's own model from its file."""
    from udd.models.mechanisms import check_accelerations
    from udd.models.serialization import formula_model_from_dict

    refuse_others(args, "own")
    data = _model_file(args)
    data.pop("state0", None)
    model = formula_model_from_dict(data)
    if "mechanism" not in data:
        check_accelerations(model)
    return model


def start_of(args: argparse.Namespace) -> Any:
    """Return the start of hidden states in the file of the user's own model; None if it has none."""
    return None if args.model is None else _model_file(args).get("state0")


def _model_file(args: argparse.Namespace) -> dict[str, Any]:
    """Read the file of `--model`."""
    from udd._util.tables import read, table

    toml = args.model.suffix.lower() == ".toml"
    return table(str(args.model), read(args.model, toml=toml), error=UddError)


def _option_or_header(args: argparse.Namespace, measurement: Measurement, name: str) -> float | None:
    value: float | None = getattr(args, name)
    return _number(args, measurement, name) if value is None else value


def _number(args: argparse.Namespace, measurement: Measurement, name: str) -> float | None:
    """Read a number in the file's header."""
    value = measurement.meta.get(name)
    if value is None:
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        raise UddError(f"{args.file}: {name} in the header must be a number, not {value!r}") from None


def check_early(args: argparse.Namespace) -> None:
    """Refuse what no film could mend, before minutes of work are spent on it."""
    for one in _each(args):
        _check_device(one)
    if len(args.files) == 1 and getattr(args, "each", None) is not None:
        raise UddError("--each needs two or more files; leave it out for one file")
    if all(map(is_film, args.files)):
        for name in ("columns", "sampling", "repeated", "part", "limit"):
            if getattr(args, name) is not None:
                raise UddError(f"--{name} does not apply to a film: it is of tables")
    effects(args.effect)
    free_of(args)


def free_of(args: argparse.Namespace) -> list[str] | None:
    """Return the parameters that --free names; None for the model's default."""
    if args.free is None:
        return None
    free = names(args.free)
    if not free:
        raise UddError("--free names no parameter: say one, such as --free k0, or leave it out")
    return free


def _check_device(args: argparse.Namespace) -> None:
    from udd.models import Disk

    if args.model is not None:
        own_model(args)
        if is_film(args.file):
            raise UddError("a film shows a disk: --model takes a table with t and states of the model")
        return
    if args.pendulum is not None:
        refuse_others(args, "pendulum")
        pendulum(args, args.pendulum, args.inertia)
    elif args.W is not None or is_film(args.file):
        refuse_others(args, "disk")
        if args.W is None:
            raise UddError(
                f"the drive speed is not known: say --W in m/s with the film {args.file} "
                "(--W 0 if the wheels stand still)"
            )
        Disk(args.W, R=0.08 if args.R is None else args.R, **given(args, "g"))
