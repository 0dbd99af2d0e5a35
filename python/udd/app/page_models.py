"""The models that the page shows, and how: one table, by kind."""

from __future__ import annotations

from dataclasses import dataclass

from udd.errors import ModelError
from udd.models import Disk, Model

#: The paper's disk: the constants in which the DLE is shown.
PLAIN = Disk(0.0)


@dataclass(frozen=True)
class PageModel:
    """Properties of a model on the page.

    Attributes
    ----------
    ranges : dict
        For each parameter: least value, greatest value and step of its slider; factor from SI to the shown
        unit, and that unit.
    surfaces : dict
        The sections that the page offers, and the component that its return map shows.
    exponent : tuple of (float, float)
        The time of a run for an exponent, and the error that is enough.
    third : tuple of float
        A further start of a diagram; the others are the page's and its mirror image.
    metres : float
        The unit of length of its states.
    clock : float
        The model's time that passes in a second.
    drawn : str
        The quantity that is sent with the state, to draw it.
    """

    ranges: dict[str, tuple[float, float, float, float, str]]
    surfaces: dict[str, tuple[str, str]]
    exponent: tuple[float, float]
    third: tuple[float, float, float]
    metres: float
    clock: float
    drawn: str


#: The page's models by kind.
PAGE_MODELS = {
    "disk": PageModel(
        ranges={
            "W": (0.001, 0.14, 0.0001, 100.0, "cm/s"),
            "R": (0.04, 0.16, 0.001, 100.0, "cm"),
            "g": (1.0, 25.0, 0.01, 1.0, "m/s²"),
            "k0": (0.002, 0.05, 0.0001, 1.0, "m²/s"),
            "k1": (0.002, 0.3, 0.001, 1.0, "m²/s"),
            "k2": (0.0, 0.2, 0.001, 1.0, "m²"),
        },
        surfaces={"zero": ("Z", "Y"), "maxima": ("maxima of Z", "Z"), "reversals": ("reversal", "Z")},
        exponent=(160.0, 0.25),
        third=(3.0, 0.005, 0.0),
        metres=1.0,
        clock=1.0,
        drawn="J",
    ),
    "dle": PageModel(
        ranges={"w": (0.05, 12.0, 0.001, 1.0, ""), "B": (0.0, 0.9, 0.001, 1.0, "")},
        surfaces={"zero": ("z", "y"), "maxima": ("maxima of z", "z"), "reversals": ("reversal", "z")},
        exponent=(1200.0, 0.03),
        third=(0.1, 0.2, 1.5),
        metres=2 * PLAIN.k0**2 / (PLAIN.g * PLAIN.R**2),
        clock=2.0 * PLAIN.k0 / PLAIN.R**2,
        drawn="beta",
    ),
}


def page_model(model: Model) -> PageModel:
    """Return the properties of a model on the page.

    Raises
    ------
    ModelError
        It does not show it.
    """
    if model.kind not in PAGE_MODELS:
        raise ModelError(f"the page shows a disk or the dle, not {model.kind!r}")
    return PAGE_MODELS[model.kind]
