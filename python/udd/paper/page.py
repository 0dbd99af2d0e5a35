"""Page with pictures and the table of claims, in one self-contained file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING

from udd._util.data_uri import data_uri
from udd._util.html_templates import templates
from udd._util.versions import versions

from .registry import FAILS, HOLDS, REMARK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .make import Checked, Drawn
    from .registry import Claim
    from .registry import Figure as Entry

_CLASSES = {HOLDS: "holds", REMARK: "remark", FAILS: "fails"}


def png(figure: Figure, dpi: int) -> bytes:
    """Write a figure as PNG, the same bytes every time."""
    picture = BytesIO()
    figure.savefig(picture, format="png", dpi=dpi, metadata={"Software": None})
    return picture.getvalue()


def svg(figure: Figure) -> bytes:
    """Write a figure as SVG, the same bytes every time; letters are outlines, so that no font is needed."""
    import matplotlib as mpl

    picture = BytesIO()
    with mpl.rc_context({"svg.hashsalt": "udd"}):
        figure.savefig(picture, format="svg", metadata={"Date": None, "Creator": None})
    return picture.getvalue()


def sentence(text: str) -> str:
    """Format a sentence: a capital if it begins with a word, true minus signs, and a full stop."""
    start = text[0].upper() if text[1:2].islower() else text[0]
    return re.sub(r"(?<![\w.])-(?=\d)", "−", f"{start}{text[1:]}.")


def render(
    figures: Sequence[Drawn], claims: Sequence[Checked], left_out: Sequence[Entry | Claim] = ()
) -> str:
    """Render the page as HTML."""
    environment = templates("udd.paper")
    environment.filters["sentence"] = sentence
    return environment.get_template("index.html").render(
        figures=[(entry, _embedded(entry)) for entry in figures],
        claims=claims,
        classes=_CLASSES,
        counts=Counter(entry.verdict.verdict for entry in claims),
        order=(HOLDS, REMARK, FAILS),
        left_out=left_out,
        filmed=any(entry.figure.filmed for entry in figures),
        versions=versions("udd", "numpy", "scipy", "matplotlib"),
    )


def _embedded(drawn: Drawn) -> str:
    kind = "svg+xml" if drawn.figure.vector else "png"
    return data_uri(f"image/{kind}", drawn.path.read_bytes())
