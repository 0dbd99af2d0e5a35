"""Formulas as MathML, which browsers show by themselves: no script, and nothing fetched."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml


def inline(self: Any, node: nodes.math) -> None:
    """A formula in a line."""
    self.body.append(tex2mathml(node.astext(), as_block=False))
    raise nodes.SkipNode


def block(self: Any, node: nodes.math_block) -> None:
    """A formula of its own; not numbered."""
    text = tex2mathml(node.astext(), as_block=True)
    self.body.append(f'<div class="math notranslate nohighlight">\n{text}\n</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Enter the renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
