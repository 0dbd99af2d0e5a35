"""Which parameters a fit leaves free, and what is known of them beforehand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from udd import _core
from udd.errors import FitError
from udd.models import Disk, Model, Pendulum

#: What is known of a camera beforehand, as standard deviations around zero: a pivot found to a few
#: millimetres, a picture upright to 2 degrees and scaled to 1 %, marks whose centre is off by a millimetre,
#: an orientation that lags the position by milliseconds, a shutter that may roll (a frame's time over a
#: picture 0.4 m high), a clock good to 0.3 %.
CAMERA = {
    "disk": {
        "y0": 5e-3,
        "z0": 5e-3,
        "tilt": 0.035,
        "scale": 0.01,
        "right": 1e-3,
        "up": 1e-3,
        "lag": 0.01,
        "row": 0.05,
    },
    "pendulum": {"theta0": 0.1},
}
CLOCK = 3e-3

#: Relative standard deviations of the parameters that a fit leaves free by default.
DISK = {"k0": 1.0, "k1": 1.0, "k2": 1.0, "W": 0.05}
PENDULUM = {"k0": np.inf, "length": 0.05, "inertia": 0.1}


@dataclass(frozen=True)
class Free:
    """A free parameter: its name, what it belongs to, and its Gaussian prior."""

    name: str
    role: str
    index: int
    mean: float
    sd: float

    @property
    def core(self) -> tuple[str, int, float, float]:
        """As the core takes it."""
        return self.role, self.index, self.mean, self.sd


def free_parameters(
    model: Model,
    free: Iterable[str] | None = None,
    camera: bool | Iterable[str] = True,
    priors: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[Free, ...]:
    """The free parameters of a fit.

    Parameters
    ----------
    model : Disk or Pendulum
        Its values are the priors' means.
    free : iterable of str, optional
        Names of the model's free parameters. By default ``k0, k1, k2, W`` of a disk, ``k0, length, inertia``
        of a pendulum, and the amplitudes of all effects.
    camera : bool or iterable of str
        Whether the camera's parameters are free, or which.
    priors : mapping of str to (mean, standard deviation), optional
        Replaces the default priors.

    Raises
    ------
    FitError
        A name that the model or the camera does not have, or a prior that is none.
    """
    values = model.parameters
    amplitudes = {f"{e.name}.{p}" for e in model.effects for p in e.amplitudes}
    spread: dict[str, float] = {}
    if isinstance(model, Disk):
        spread = {n: s * abs(values[n]) for n, s in DISK.items()}
        # A drive at rest is at rest.
        spread = {n: s for n, s in spread.items() if n != "W" or s > 0}
        spread = {n: s if s > 0 else np.inf for n, s in spread.items()}
    elif isinstance(model, Pendulum):
        spread = {n: s * abs(values[n]) if np.isfinite(s) else np.inf for n, s in PENDULUM.items()}
    if isinstance(free, str) or isinstance(camera, str):
        raise FitError("free and camera are lists of names, not a name")
    names = list(spread) + [n for n in values if n in amplitudes] if free is None else list(free)
    kind = "disk" if isinstance(model, Disk) else "pendulum"
    known = {**CAMERA[kind], **({"clock": CLOCK} if kind == "disk" else {})}
    wanted = list(known) if camera is True else [] if camera is False else list(camera)
    twice = {name for name in [*names, *wanted] if [*names, *wanted].count(name) > 1}
    if twice:
        raise FitError(f"{', '.join(sorted(twice))} is named twice")
    for name in names:
        if name not in values:
            raise FitError(f"the model has no parameter {name!r}; it has {', '.join(values)}")
    for name in wanted:
        if name not in known:
            raise FitError(f"the camera has no parameter {name!r}; it has {', '.join(known)}")

    order = list(values)
    cameras = [name for name, _unit in _core.camera_parameters(kind)]
    result = []
    for name in names:
        sd = np.inf if name in amplitudes else spread.get(name, np.inf)
        result.append(Free(name, "model", order.index(name), values[name], sd))
    for name in wanted:
        role, index = ("clock", 0) if name == "clock" else ("camera", cameras.index(name))
        result.append(Free(name, role, index, 0.0, known[name]))
    given = dict(priors or {})
    for name, prior in given.items():
        if not (isinstance(prior, (tuple, list)) and len(prior) == 2):
            raise FitError(f"the prior of {name} must be a mean and a standard deviation, not {prior!r}")
        mean, sd = prior
        if not (np.isfinite(mean) and sd > 0):
            raise FitError(
                f"the prior of {name} needs a finite mean and a standard deviation that must be positive"
            )
    unknown = set(given) - {f.name for f in result}
    if unknown:
        raise FitError(f"a prior is given for {', '.join(sorted(unknown))}, which is not free")
    return tuple(Free(f.name, f.role, f.index, *given.get(f.name, (f.mean, f.sd))) for f in result)
