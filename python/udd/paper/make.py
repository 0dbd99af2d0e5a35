"""Draw all figures, check all claims, and write the page."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from udd._util.atomic_files import made_folder, write_whole
from udd._util.one_line import OneLine, link_to
from udd._util.progress import status
from udd.errors import UddError

from . import page
from .registry import CLAIMS, FIGURES, Claim, Figure, Verdict
from .shared_films import Lab

_DPI = 150


@dataclass(frozen=True, repr=False)
class Drawn(OneLine):
    """Picture of a figure.

    Attributes
    ----------
    figure : Figure
    path : Path
        The picture, PNG or SVG.
    width : float
        Width of the picture [inch], so that all are shown at one scale with text of one size.
    seconds : float
        Time to draw it, without films that existed already.

    See Also
    --------
    udd.paper.Figure : the figure that it shows.
    """

    figure: Figure
    path: Path
    width: float
    seconds: float


@dataclass(frozen=True, repr=False)
class Checked(OneLine):
    """Result of a claim's check.

    Attributes
    ----------
    claim : Claim
    verdict : Verdict
    seconds : float
        Time to check it.

    See Also
    --------
    udd.paper.Verdict : what the check gave.
    """

    claim: Claim
    verdict: Verdict
    seconds: float


@dataclass(frozen=True, repr=False)
class Reproduction:
    """Result of :func:`reproduce`.

    Attributes
    ----------
    page : Path
        The page with all pictures and the table of claims.
    figures : tuple of Drawn
    claims : tuple of Checked
    left_out : tuple of Figure or Claim
        Entries that need films, if films were excluded.

    See Also
    --------
    udd.paper.reproduce : makes it.
    """

    page: Path
    figures: tuple[Drawn, ...]
    claims: tuple[Checked, ...]
    left_out: tuple[Figure | Claim, ...] = ()

    def __repr__(self) -> str:
        holds = sum(check.verdict.verdict == "holds" for check in self.claims)
        text = f"{len(self.figures)} figures, {len(self.claims)} claims, {holds} of which hold"
        return f"<Reproduction {self.page}: {text}>"

    def _repr_html_(self) -> str:
        return link_to(self.page, repr(self)[1:-1].rpartition(": ")[2])


def reproduce(
    out: str | os.PathLike[str],
    *,
    only: Iterable[str] | None = None,
    films: bool = True,
    progress: bool | Callable[[str], object] | None = None,
) -> Reproduction:
    """Draw the paper's figures, check its claims, and write the page.

    Parameters
    ----------
    out : path
        Folder to write to; created if necessary. Films and their tracked motion stay in its folder ``films``
        and are used again.
    only : iterable of str, optional
        Keys of figures and claims (see :data:`FIGURES`, :data:`CLAIMS`); default: all.
    films : bool
        True to include figures and claims that need films, which take minutes the first time.
    progress : bool or callable, optional
        True shows a progress bar, False none; a function gets the state of the work as a text. Default: a bar
        after 2 s in a terminal or a notebook.

    Returns
    -------
    Reproduction
        `page` is the file with all pictures; `figures` and `claims` hold the results.

    Raises
    ------
    UddError
        A key is unknown, a key needs films but ``films=False``, or the folder cannot be written to.

    See Also
    --------
    udd.paper.Reproduction : the result.
    udd.plot.draw : draw any result.

    Examples
    --------
    >>> import tempfile, udd
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = udd.paper.reproduce(folder, only=["eigenvalues", "scales"])
    >>> made.claims[0].verdict.verdict
    'holds'
    """
    chosen_figures, chosen_claims, left_out = _chosen(only, films)
    folder = made_folder(out)
    with status(progress) as tell:
        drawn, checked = _worked(folder, chosen_figures, chosen_claims, tell)
    target = folder / "index.html"
    write_whole(target, page.render(drawn, checked, left_out).encode())
    return Reproduction(target, tuple(drawn), tuple(checked), tuple(left_out))


def _worked(
    folder: Path,
    figures: Sequence[Figure],
    claims: Sequence[Claim],
    tell: Callable[[str], None],
) -> tuple[list[Drawn], list[Checked]]:
    """Draw the figures, and check the claims."""
    lab = Lab(folder / "films", tell)
    drawn = []
    for entry in figures:
        tell(f"drawing {entry.key}")
        start = time.perf_counter()
        path = folder / f"{entry.key}.{'svg' if entry.vector else 'png'}"
        picture = entry.draw(lab)
        write_whole(path, page.svg(picture) if entry.vector else page.png(picture, _DPI))
        drawn.append(Drawn(entry, path, picture.get_figwidth(), time.perf_counter() - start))
    checked = []
    for claim in claims:
        tell(f"checking {claim.key}")
        start = time.perf_counter()
        checked.append(Checked(claim, claim.check(lab), time.perf_counter() - start))
    return drawn, checked


def _chosen(
    only: Iterable[str] | None, films: bool
) -> tuple[list[Figure], list[Claim], list[Figure | Claim]]:
    """Return the chosen figures and claims in the paper's order, and those left out for lack of films."""
    keys = None if only is None else set([only] if isinstance(only, str) else only)
    for key in sorted(keys or ()):
        entry = FIGURES.get(key) or CLAIMS.get(key)
        if entry is None:
            raise UddError(
                f"no figure or claim is called {key!r}; the figures are {', '.join(FIGURES)}; the claims "
                f"are {', '.join(CLAIMS)}"
            )
        if entry.filmed and not films:
            raise UddError(f"{key} needs a film, but films are excluded; allow them, or leave {key} out")
    figures = [entry for entry in FIGURES.values() if keys is None or entry.key in keys]
    claims = [entry for entry in CLAIMS.values() if keys is None or entry.key in keys]
    chosen: list[Figure | Claim] = [*figures, *claims]
    left_out = [] if films else [entry for entry in chosen if entry.filmed]
    return [f for f in figures if f not in left_out], [c for c in claims if c not in left_out], left_out
