"""A report as data: sections of text, figures and tables, for the page and the app."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from markupsafe import Markup

from udd._util.one_line import OneLine, cut, link_to

Text = str | Markup  #: Plain text, or text with HTML in it that was made here.


_RAISED = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")


def plain(text: Text) -> str:
    """Return a text without its HTML; exponents stay raised."""
    return text_of(text) if isinstance(text, Markup) else text


def text_of(markup: object) -> str:
    """Return markup as plain text, with raised exponents, and indices as in W_c."""
    raised = re.sub(r"<sup>(.*?)</sup>", lambda m: m[1].translate(_RAISED), str(markup)).replace("<sub>", "_")
    return html.unescape(re.sub(r"<[^>]*>", "", raised))


@dataclass(frozen=True, repr=False)
class Image(OneLine):
    """A picture, as a data URI, with what it shows in words, and its width on the page in pixels."""

    uri: str
    alt: str
    width: int

    @property
    def ending(self) -> str:
        """The ending of its file name."""
        kind = self.uri.removeprefix("data:").partition(";")[0]
        return {"image/svg+xml": "svg"}.get(kind, kind.partition("/")[2])

    @property
    def content(self) -> bytes:
        """The file."""
        return base64.b64decode(self.uri.partition(";base64,")[2])


@dataclass(frozen=True, repr=False)
class Movie(Image):
    """A moving picture that loops.

    Attributes
    ----------
    uri : str
        A film (``data:video/mp4``), or a drawing that moves (``data:image/svg+xml``).
    titles : tuple of str
        Titles of its panels, from the left.
    start, seconds : float
        Time at which the free runs start, and for how long they are shown, s.
    filmed : bool
        True if the first panel is the film itself.
    """

    titles: tuple[str, ...]
    start: float
    seconds: float
    filmed: bool


@dataclass(frozen=True, repr=False)
class Paragraph(OneLine):
    """A paragraph; `style` is a class of the page's style sheet."""

    kind: ClassVar[str] = "paragraph"
    text: Text
    style: str = ""


@dataclass(frozen=True, repr=False)
class Subheading(OneLine):
    """A heading within a section."""

    kind: ClassVar[str] = "subheading"
    text: Text


@dataclass(frozen=True, repr=False)
class Bullets(OneLine):
    """A list."""

    kind: ClassVar[str] = "bullets"
    entries: tuple[Text, ...]


@dataclass(frozen=True, repr=False)
class Figure(OneLine):
    """A picture with its caption."""

    kind: ClassVar[str] = "figure"
    image: Image
    caption: Text


@dataclass(frozen=True, repr=False)
class Gallery(OneLine):
    """Small pictures side by side."""

    kind: ClassVar[str] = "gallery"
    figures: tuple[Figure, ...]


@dataclass(frozen=True, repr=False)
class Column(OneLine):
    """A column of a table: its heading, and whether it holds numbers or the rows' names."""

    title: Text
    number: bool = False
    names: bool = False


@dataclass(frozen=True, repr=False)
class Table(OneLine):
    """A table of text.

    Attributes
    ----------
    title : str
        Its name when it stands alone.
    columns : tuple of Column
    rows : tuple of tuple of str
    caption : str
    summary : str
        The line that is shown while it is folded; "" if it cannot be folded.
    open : bool
        True if it begins unfolded.
    marked : frozenset of int
        The rows that stand out.
    """

    kind: ClassVar[str] = "table"
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Text, ...], ...]
    caption: Text = ""
    summary: Text = ""
    open: bool = False
    marked: frozenset[int] = frozenset()

    def plain(self) -> list[list[str]]:
        """Return the cells without HTML, the headings first."""
        return [[plain(c.title) for c in self.columns], *([plain(cell) for cell in row] for row in self.rows)]


@dataclass(frozen=True, repr=False)
class Clickable(OneLine):
    """Frames of a film to click on; `data` is JSON for ``clicks.js``."""

    kind: ClassVar[str] = "clickable"
    data: Markup


Part = Paragraph | Subheading | Bullets | Figure | Gallery | Table | Clickable


@dataclass(frozen=True, repr=False)
class Section(OneLine):
    """A heading and what stands under it."""

    heading: Text
    parts: tuple[Part, ...]


@dataclass(frozen=True, repr=False)
class Number(OneLine):
    """A number at the top: its name, its value, a remark, and a class of the style sheet."""

    what: Text
    value: Text
    remark: Text = ""
    style: str = ""


@dataclass(frozen=True, repr=False)
class Head(OneLine):
    """The head of a report.

    Attributes
    ----------
    kicker, title : str
    verdict : str
        In a word or two, after the kicker.
    said : tuple of Paragraph
    numbers : tuple of Number
    notes : tuple of Paragraph
        After the numbers.
    """

    kicker: str
    title: Text
    verdict: str = ""
    said: tuple[Paragraph, ...] = ()
    numbers: tuple[Number, ...] = ()
    notes: tuple[Paragraph, ...] = ()


@dataclass(frozen=True, repr=False)
class Report:
    """A report.

    Attributes
    ----------
    head : Head
    sections : tuple of Section
    source : tuple of str, optional
        The name of the file that it began with, and its SHA-256.
    command : str, optional
        How it was made.
    path : Path, optional
        Place of the page, if it was written.
    """

    head: Head
    sections: tuple[Section, ...]
    source: tuple[str, str] | None = None
    command: str | None = None
    path: Path | None = None

    def __repr__(self) -> str:
        where = f" {self.path}" if self.path is not None else ""
        return f"<Report{where}: {cut(self._text, 200)}>"

    def _repr_html_(self) -> str:
        return (
            link_to(self.path, self._text) if self.path is not None else f"<p>{html.escape(self._text)}</p>"
        )

    @property
    def _text(self) -> str:
        verdict = " ".join((self.head.verdict or plain(self.head.title)).split())
        parts = f"{len(self.sections)} sections, {len(self.images)} pictures, {len(self.tables)} tables"
        return f"{verdict}; {parts}"

    def parts(self) -> Iterator[Part]:
        """Yield all parts in their order, those of galleries too."""
        for section in self.sections:
            for part in section.parts:
                yield from part.figures if isinstance(part, Gallery) else (part,)

    @property
    def images(self) -> list[Image]:
        """All pictures."""
        return [part.image for part in self.parts() if isinstance(part, Figure)]

    @property
    def tables(self) -> list[Table]:
        """All tables."""
        return [part for part in self.parts() if isinstance(part, Table)]


def table(
    title: str, columns: Mapping[str, Column], rows: Iterable[Mapping[str, Text]], caption: Text = ""
) -> Table:
    """Make a table of these columns from rows by name."""
    cells = tuple(tuple(row[name] for name in columns) for row in rows)
    return Table(title, tuple(columns.values()), cells, caption)


def parts(*given: Part | Sequence[Part] | None) -> tuple[Part, ...]:
    """Return the parts that are not None, in order."""
    result: list[Part] = []
    for one in given:
        if one is not None:
            result += one if isinstance(one, Sequence) else [one]
    return tuple(result)
