"""Tracked films that figures and claims share, and their folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from udd._util.atomic_files import made_folder
from udd.fitting import Fit
from udd.measurement import Measurement

from . import device, films
from .savgol import Smoothed, smoothed


@dataclass
class Lab:
    """Folder for films, and a callback for progress.

    Attributes
    ----------
    folder : Path
        Folder of the films and their tracked motion.
    tell : callable
        Called with a short description of each step.
    """

    folder: Path
    tell: Callable[[str], None]
    _measured: dict[str, Measurement] = field(default_factory=dict)
    _fitted: list[Fit] = field(default_factory=list)

    def measured(self, name: str) -> Measurement:
        """Return the tracked motion in the film of a drive in cm/s, such as ``"1.4"``."""
        if name not in self._measured:
            self._measured[name] = films.measured(name, made_folder(self.folder), self.tell)
        return self._measured[name]

    def smoothed(self, name: str) -> Smoothed:
        """Return the tracked motion, smoothed, with the angular velocity."""
        W = films.RECIPES[name].W
        return smoothed(self.measured(name), device.disk(W))

    def friction_fit(self) -> Fit:
        """Fit the friction law to the film without a drive, from a start away from the solution."""
        from udd.fitting.fit import fit

        if not self._fitted:
            measured = self.measured("0.0")
            self.tell("fitting the friction law")
            start = device.disk(0.0).replace(k0=0.02, k1=0.08, k2=0.04)
            # An ideal camera is assumed, and the disk's size sets the scale.
            camera = ["y0", "z0", "tilt"]
            self._fitted.append(fit(measured, start, free=["k0", "k1", "k2"], camera=camera))
        return self._fitted[0]
