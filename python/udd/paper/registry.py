"""Registry of the paper's figures and claims."""

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
    """Figure of the paper, or about its discussion.

    Attributes
    ----------
    key : str
        Name on the command line and of the file.
    paper : str
        Number of the figure in the paper, or the section that it belongs to.
    title, caption : str
    filmed : bool
        True if it needs films to be made and tracked.
    draw : callable
        Makes the picture.
    vector : bool
        True if it is stored as vector graphics (SVG), for simple drawings.

    See Also
    --------
    udd.paper.Drawn : the picture of a figure.
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
    """Result of checking a claim.

    Attributes
    ----------
    verdict : {"holds", "holds with a remark", "does not hold"}
    evidence : str
        The numbers.
    remark : str
        A qualification, if any.

    See Also
    --------
    udd.paper.Claim : the claim that was checked.
    """

    verdict: str
    evidence: str
    remark: str = ""


@dataclass(frozen=True)
class Claim:
    """Sentence of the paper that can be computed.

    Attributes
    ----------
    key : str
        Name on the command line.
    place : str
        Section of the paper.
    says : str
        The claim, in short.
    filmed : bool
        True if it needs films to be made and tracked.
    check : callable
        Computes it.

    See Also
    --------
    udd.paper.Verdict : result of its check.
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
    """Register a function as a figure."""

    def enter(draw: Draw) -> Draw:
        FIGURES[key] = Figure(key, paper, title, caption, filmed, draw, vector)
        return draw

    return enter


def claim(key: str, *, place: str, says: str, filmed: bool = False) -> Callable[[Check], Check]:
    """Register a function as a claim."""

    def enter(check: Check) -> Check:
        CLAIMS[key] = Claim(key, place, says, filmed, check)
        return check

    return enter


def judged(holds: bool, evidence: str, remark: str = "", otherwise: str = "") -> Verdict:
    """Return the verdict on a claim, with `remark` if it holds and `otherwise` if it does not."""
    if holds:
        return Verdict(REMARK if remark else HOLDS, evidence, remark)
    return Verdict(FAILS, evidence, otherwise)
