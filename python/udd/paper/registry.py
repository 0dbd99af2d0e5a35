"""What a figure and a claim of the paper are, and the lists of all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import matplotlib.figure

    from .shared_films import Lab

HOLDS = "holds"
REMARK = "holds with a remark"
FAILS = "does not hold"

Draw = Callable[["Lab"], "matplotlib.figure.Figure"]
Check = Callable[["Lab"], "Verdict"]


@dataclass(frozen=True)
class Figure:
    """A figure of the paper, or of what it discusses.

    Attributes
    ----------
    key : str
        What it is called on the command line and as a file.
    paper : str
        Which figure of the paper it is, or which part it belongs to.
    title, caption : str
    filmed : bool
        Whether it needs films to be made and tracked.
    draw : callable
        Makes the picture.
    vector : bool
        Whether it is kept as vector graphics (SVG): drawings of few lines.
    """

    key: str
    paper: str
    title: str
    caption: str
    filmed: bool
    draw: Draw
    vector: bool = False


@dataclass(frozen=True)
class Verdict:
    """What has become of a claim.

    Attributes
    ----------
    verdict : {"holds", "holds with a remark", "does not hold"}
    evidence : str
        The numbers.
    remark : str
        What should be said beside them, if anything.
    """

    verdict: str
    evidence: str
    remark: str = ""


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper that can be computed.

    Attributes
    ----------
    key : str
        What it is called on the command line.
    place : str
        Where in the paper it stands.
    says : str
        The claim, in short.
    filmed : bool
        Whether it needs films to be made and tracked.
    check : callable
        Computes it.
    """

    key: str
    place: str
    says: str
    filmed: bool
    check: Check


FIGURES: dict[str, Figure] = {}
CLAIMS: dict[str, Claim] = {}


def figure(
    key: str, *, paper: str, title: str, caption: str, filmed: bool = False, vector: bool = False
) -> Callable[[Draw], Draw]:
    """Enter a function into the list of figures."""

    def enter(draw: Draw) -> Draw:
        FIGURES[key] = Figure(key, paper, title, caption, filmed, draw, vector)
        return draw

    return enter


def claim(key: str, *, place: str, says: str, filmed: bool = False) -> Callable[[Check], Check]:
    """Enter a function into the list of claims."""

    def enter(check: Check) -> Check:
        CLAIMS[key] = Claim(key, place, says, filmed, check)
        return check

    return enter


def judged(holds: bool, evidence: str, remark: str = "", otherwise: str = "") -> Verdict:
    """The verdict on a claim: `remark` is said where it holds, `otherwise` where it does not."""
    if holds:
        return Verdict(REMARK if remark else HOLDS, evidence, remark)
    return Verdict(FAILS, evidence, otherwise)
