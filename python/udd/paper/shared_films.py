"""Where figures and claims get what they share: films that were tracked, and a place to keep them."""

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
    """The folder for films, and who is told what is being done.

    Attributes
    ----------
    folder : Path
        Where films and what was tracked in them are kept.
    tell : callable
        Told in a few words.
    """

    folder: Path
    tell: Callable[[str], None]
    _measured: dict[str, Measurement] = field(default_factory=dict)
    _fitted: list[Fit] = field(default_factory=list)

    def measured(self, name: str) -> Measurement:
        """What was tracked in the film of a drive in cm/s, such as ``"1.4"``."""
        if name not in self._measured:
            self._measured[name] = films.measured(name, made_folder(self.folder), self.tell)
        return self._measured[name]

    def smoothed(self, name: str) -> Smoothed:
        """The same, smoothed, with the angular velocity."""
        W = films.RECIPES[name].W
        return smoothed(self.measured(name), device.disk(W))

    def friction_fit(self) -> Fit:
        """The friction law, fitted to the film without a drive, from a start that is not the answer."""
        from udd.fitting.fit import fit

        if not self._fitted:
            measured = self.measured("0.0")
            self.tell("fitting the friction law")
            start = device.disk(0.0).replace(k0=0.02, k1=0.08, k2=0.04)
            # The camera is a plain one, and the disk's size sets the scale.
            camera = ["y0", "z0", "tilt"]
            self._fitted.append(fit(measured, start, free=["k0", "k1", "k2"], camera=camera))
        return self._fitted[0]
