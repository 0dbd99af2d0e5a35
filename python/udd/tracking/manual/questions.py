"""Questions to a person who clicks on a frame, and the options from the answers; no window here."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from udd.markers.layout import Layout, read_layout
from udd.video.reader import Picture, TrackError

from .circle import Circle, circle
from .patches import CLICK, Patch, patch

ROWS = 600  # of a picture for which there is room on the screen; of more, a hand misses more pixels
# in units of what a hand misses:
PIVOT = 2.0  # the contact is hidden behind the wheels, and guessed
CENTRE = 2.0  # so is a centre with nothing on it
SNAP = 3.0  # from a mark's middle, within which that middle is meant
SHORTEST = 20.0  # pixels between two points with a known distance
NARROWEST = 16.0  # pixels: side of a region
SAME_PAINT = 0.966  # cosine between two marks' colours' directions (15 degrees) above which it is one paint
OUTSIDE = 1.05  # of the disk's radius: no mark lies beyond
RADIUS = 0.08  # m: of the disk where nobody says it

ASKED = {
    "pivot": "Click the point about which the disk turns, where the wheels hold it.",
    "marks": "Click the middle of each coloured mark, beginning with the one that is above the disk's centre "
    "when beta is 0.",
    "ruler": "Click two points of the disk that are {distance:g} m apart; best the middles of two marks.",
    "rim": "Click the disk's edge at three places or more, far apart; or, once, its centre.",
    "region": "Click two opposite corners (or drag) of the part of the picture in which the disk moves.",
    "end": "That is all: Enter writes it down.",
}
SKIPPED = {
    "pivot": "Enter without a click: it is found from the motion.",
    "marks": "Enter without a click: the paper's own four, red, orange, blue, green.",
    "ruler": "Enter without a click: the disk's radius tells the scale.",
    "region": "Enter without a click: all of the picture.",
}


@dataclass(frozen=True)
class Answers:
    """Clicked points, in pixels (u + iv)."""

    pivot: complex | None = None
    marks: tuple[Patch, ...] = ()
    ruler: tuple[complex, ...] = ()
    rim: tuple[complex, ...] = ()
    region: tuple[complex, ...] = ()


@dataclass(frozen=True)
class _State:
    question: str
    answers: Answers = Answers()


class ClickSession:
    """Questions about one frame, one after the other, and their answers.

    Parameters
    ----------
    picture : Picture
        The frame.
    full_range : bool
        True if its brightness goes from 0 to 255.
    known : mapping
        Options that are given already, as in a config file. They are not asked for.
    distance : float, optional
        Between the two points that are asked for [m].

    Raises
    ------
    TrackError
        What is known has no use for clicks, or says the scale twice.
    """

    def __init__(
        self, picture: Picture, full_range: bool, known: Mapping[str, Any], distance: float | None = None
    ) -> None:
        check(known, distance)
        self.picture, self.full_range = picture, full_range
        self.known, self.distance = dict(known), distance
        self.remark = ""  # to the last click
        self.history = [_State("")]
        self.history[0] = _State(self._after(""))

    @property
    def miss(self) -> float:
        """Standard error of a click [pixels]."""
        return max(CLICK, CLICK * float(self.picture.y.shape[0]) / ROWS)

    @property
    def question(self) -> str:
        """Name of the present question, one of `ASKED`; empty if all are answered."""
        return self.history[-1].question

    @property
    def answers(self) -> Answers:
        """Clicked points."""
        return self.history[-1].answers

    @property
    def done(self) -> bool:
        """True if all questions are answered."""
        return not self.question

    @property
    def sentence(self) -> str:
        """The question as a sentence."""
        return ASKED[self.question].format(distance=self.distance or 0.0) if self.question else ""

    @property
    def hint(self) -> str:
        """Effect of the Enter key."""
        if self.question == "end":
            return ""
        here = getattr(self.answers, self.question) if self.question else None
        return SKIPPED.get(self.question, "") if here in (None, ()) else "Enter: go on with what is clicked."

    def show(self, picture: Picture) -> bool:
        """Take another frame, while nothing of the disk is clicked in this one; whether that could be."""
        a = self.answers
        if a.marks or a.ruler or a.rim:
            self.remark = "The disk is clicked in this frame: take that back (Backspace) to see another."
            return False
        self.picture, self.remark = picture, ""
        return True

    def press(self, at: complex) -> None:
        """Handle a click at a place in the picture [pixels]."""
        self.remark = ""
        height, width = self.picture.y.shape
        if not (-0.5 <= at.real <= width - 0.5 and -0.5 <= at.imag <= height - 0.5):
            self.remark = "That is outside the picture."
            return
        a = self.answers
        if self.question == "pivot":
            self._put(replace(a, pivot=at))
        elif self.question == "marks":
            self._mark(at)
        elif self.question == "rim":
            self._put(replace(a, rim=(*a.rim, at)))
        elif self.question == "ruler":
            close = [m.centre for m in a.marks if abs(m.centre - at) < SNAP * self.miss]
            self._pair("ruler", close[0] if close else at, SHORTEST, "too near to each other to tell a scale")
        elif self.question == "region":
            self._pair("region", at, NARROWEST, "too near to each other for a region")

    def release(self, at: complex) -> None:
        """Handle the released button: the second corner of a region."""
        first = self.answers.region
        if self.question == "region" and len(first) == 1 and abs(at - first[0]) > NARROWEST:
            self.press(at)

    def accept(self) -> None:
        """Go on to the next question, if this one is answered or may be skipped."""
        self.remark = ""
        if self.done:
            return
        self.remark = self._lacking()
        if not self.remark:
            self.history.append(_State(self._after(self.question), self.answers))

    def undo(self) -> None:
        """Take back the last click, or go back to the question before."""
        self.remark = ""
        if len(self.history) > 1:
            self.history.pop()

    def config(self) -> dict[str, Any]:
        """Return the given and the clicked options, as in a config file."""
        a, out = self.answers, dict(self.known)
        calibrate, sigma = dict(out.pop("calibrate", {})), dict(out.pop("sigma", {}))
        if a.pivot is not None:
            out["pivot"] = [round(a.pivot.real, 2), round(a.pivot.imag, 2)]
            sigma["pivot"] = round(PIVOT * self.miss, 2)
            calibrate.setdefault("pivot", True)
        if a.region:
            (u0, v0), (u1, v1) = ((z.real, z.imag) for z in a.region)
            out["region"] = [float(round(x)) for x in (min(u0, u1), min(v0, v1), max(u0, u1), max(v0, v1))]
        size = self._size()
        if size is not None and "scale" not in self.known:
            scale, error = size
            out["scale"], sigma["scale"] = round(scale, 3), round(error, 3)
            if self.ends is not None:
                out["apart"] = [*self.ends, self.distance]
            # a length that was clicked is all that is known of the size, where nobody says the radius
            alone = len(a.ruler) == 2 and self.ends is None and "disk_radius" not in self.known
            calibrate.setdefault("scale", not alone)
        if a.marks and size is not None:
            centre, centre_sigma, radius = self._disk()
            out["layout"] = _layout(a.marks, centre, size[0])
            worst = max(m.sigma for m in a.marks)
            sigma["layout"] = round(float(np.hypot(worst, centre_sigma)) / size[0], 6)
            if radius is not None:
                out.setdefault("disk_radius", round(radius / size[0], 6))
        tables = {"calibrate": calibrate, "sigma": sigma}
        return out | {name: table for name, table in tables.items() if table}

    def _put(self, answers: Answers) -> None:
        self.history.append(_State(self.question, answers))

    def _after(self, question: str) -> str:
        """Return the question after another."""
        asked = [name for name in ASKED if self._wanted(name)] + [""]
        return asked[asked.index(question) + 1] if question else asked[0]

    def _wanted(self, name: str) -> bool:
        if name == "rim":
            return bool(self.answers.marks)
        if name == "ruler":
            return self.distance is not None
        if name == "marks":
            return self.known.get("layout") is None and self.known.get("mark_distance") is None
        return self.known.get(name) is None

    def _mark(self, at: complex) -> None:
        a = self.answers
        if any(m.holds(at) for m in a.marks):
            self.remark = "That mark is clicked already."
            return
        clicked = patch(self.picture, at, self.full_range, self.miss)
        if clicked is None:
            self.remark = "There is no colour there: click the middle of a coloured mark."
            return
        if clicked.refined and any(abs(m.centre - clicked.centre) < SNAP * self.miss for m in a.marks):
            self.remark = "That mark is clicked already."
            return
        if not clicked.refined:
            self.remark = "Its edges are not all clear (is it hidden in part?): it is taken as clicked."
        self._put(replace(a, marks=(*a.marks, clicked)))

    def _pair(self, name: str, at: complex, least: float, why: str) -> None:
        """One of the two points of a ruler or a region."""
        here: tuple[complex, ...] = getattr(self.answers, name)
        if len(here) == 2:
            self.remark = "Two points are all: Enter goes on, Backspace takes one back."
        elif here and (
            abs(at - here[0]) < least
            if name == "ruler"
            else min(abs((at - here[0]).real), abs((at - here[0]).imag)) < least
        ):
            self.remark = f"These two points are {why}."
        elif name == "ruler":
            self._put(replace(self.answers, ruler=(*here, at)))
        else:
            self._put(replace(self.answers, region=(*here, at)))

    def _lacking(self) -> str:
        """Return the reason why the present question cannot be left; empty if it can."""
        a = self.answers
        if self.question == "marks" and a.marks:
            return _faults(a.marks)
        if self.question in ("ruler", "region") and len(getattr(a, self.question)) == 1:
            return "One point is clicked, two are needed: click the other, or take it back (Backspace)."
        if self.question == "rim":
            return self._rim_lacking()
        return ""

    def _rim_lacking(self) -> str:
        rim = self.answers.rim
        if not rim:
            return "Marks need to know where the disk's centre is: click its edge, or the centre."
        if len(rim) == 2:
            return "Two points fix no circle: click a third one on the edge."
        edge = self.edge
        if len(rim) > 2 and edge is None:
            return "These points fix no circle: take some back (Backspace) and click further round the edge."
        if edge is not None:
            away = max(abs(m.centre - edge.centre) for m in self.answers.marks)
            if away > OUTSIDE * edge.radius:
                return "A mark lies outside the edge that is clicked: take a point back (Backspace)."
        if self._size() is None:
            return "The centre alone does not say how large the disk is: click its edge at two more places."
        return ""

    @property
    def edge(self) -> Circle | None:
        """The circle through what is clicked of the disk's edge; None where that fixes none."""
        rim = self.answers.rim
        return circle(np.array(rim), self.miss) if len(rim) > 2 else None

    def _disk(self) -> tuple[complex, float, float | None]:
        """Return the disk's centre, its standard error, and the radius if the edge was clicked [pixels]."""
        edge = self.edge
        if edge is None:
            return self.answers.rim[0], CENTRE * self.miss, None
        return edge.centre, edge.centre_sigma, edge.radius

    @property
    def ends(self) -> tuple[int, int] | None:
        """Numbers of the marks whose distance was clicked, where it was that of marks."""
        numbers = {m.centre: k for k, m in enumerate(self.answers.marks, start=1)}
        ends = [numbers[z] for z in self.answers.ruler if z in numbers]
        return (ends[0], ends[1]) if len(ends) == 2 else None

    def _size(self) -> tuple[float, float] | None:
        """Pixels per metre and the standard error; None where nothing tells."""
        ruler, scale = self.answers.ruler, self.known.get("scale")
        if scale is not None:
            return float(scale), 0.0
        if len(ruler) == 2 and self.distance is not None:
            sigma_of = {m.centre: m.sigma for m in self.answers.marks}
            error = math.hypot(*(sigma_of.get(z, self.miss) for z in ruler))
            return abs(ruler[1] - ruler[0]) / self.distance, error / self.distance
        rim = self.edge
        if rim is None:
            return None
        radius = float(self.known.get("disk_radius", RADIUS))
        return rim.radius / radius, rim.radius_sigma / radius


def check(settings: Mapping[str, Any], distance: float | None) -> None:
    """Refuse what has no use for clicks, or says the scale twice."""
    if settings.get("bob") is not None:
        raise TrackError(
            "clicks are for a disk's film: of a pendulum the bob's colour and its length are enough"
        )
    if distance is not None and settings.get("scale") is not None:
        raise TrackError("distance and scale both say how large a pixel is: say one of them")


def _faults(marks: tuple[Patch, ...]) -> str:
    """Return the fault of marks as a layout, or an empty text."""
    if len(marks) < 2:
        return "One mark is not enough: click another, or take it back (Backspace) for the paper's own four."
    middle = complex(np.mean([m.centre for m in marks]))
    try:
        read_layout(_layout(marks, middle, 1.0))
    except TrackError as error:
        return f"{str(error).removeprefix('layout: ').capitalize()}."
    return ""


def _layout(marks: tuple[Patch, ...], centre: complex, scale: float) -> list[dict[str, Any]]:
    """Return the marks as in a config file, turned so that the first one is above the centre."""
    colours = _paints(marks)
    z = (np.array([m.centre for m in marks]) - centre) / scale
    first = Layout(tuple(complex(p) for p in z), tuple(colours)).first
    z = z * (-1j * np.conj(z[first]) / abs(z[first]))
    return [
        {"at": [round(float(p.real), 6) + 0.0, round(float(-p.imag), 6) + 0.0], "colour": list(colour)}
        for p, colour in zip(z, colours, strict=True)
    ]


def _paints(marks: tuple[Patch, ...]) -> list[tuple[int, int, int]]:
    """Return the marks' colours; those of one paint in uneven light are equal."""
    chroma = Layout(tuple(m.centre for m in marks), tuple(m.colour for m in marks)).chroma
    unit = chroma / np.maximum(np.hypot(*chroma.T), 1e-9)[:, None]
    alike = unit @ unit.T > SAME_PAINT
    out: list[tuple[int, int, int]] = []
    for k in range(len(marks)):
        first = int(np.argmax(alike[k]))
        if first < k:
            out.append(out[first])
            continue
        red, green, blue = np.mean([marks[j].colour for j in np.flatnonzero(alike[k])], axis=0)
        out.append((round(float(red)), round(float(green)), round(float(blue))))
    return out
