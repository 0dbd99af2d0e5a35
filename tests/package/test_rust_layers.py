"""The modules of the Rust core use each other in one direction."""

from __future__ import annotations

import graphlib
import re
from pathlib import Path

import pytest

RUST = Path(__file__).parents[2] / "rust"
# From the lowest layer up, as CONTRIBUTING.md and rust/lib.rs have them.
LAYERS = [
    "scalar",
    "machine",
    "formula",
    "model",
    "tape",
    "integrate",
    "observe",
    "analysis",
    "estimate",
    "python",
]


def used_by(text: str) -> set[str]:
    """Return the modules of the crate that a file uses outside its tests and comments."""
    code = re.sub(r"//.*", "", text.split("#[cfg(test)]")[0])
    return set(re.findall(r"\bcrate::(?:\{\s*)?([a-z_]+)", code))


def graph() -> dict[str, set[str]]:
    """Return the modules that each top module of the crate uses."""
    uses: dict[str, set[str]] = {}
    for path in RUST.rglob("*.rs"):
        module = path.relative_to(RUST).parts[0].removesuffix(".rs")
        uses.setdefault(module, set()).update(used_by(path.read_text()) - {module})
    return uses


def test_no_module_of_the_core_uses_those_above_it() -> None:
    if not RUST.exists():
        pytest.skip("only a copy of the repository has the Rust sources")
    uses = graph()
    assert set(LAYERS) <= set(graphlib.TopologicalSorter(uses).static_order())
    for i, layer in enumerate(LAYERS):
        above = uses[layer] & set(LAYERS[i + 1 :])
        assert not above, f"{layer} uses {above}"


def test_a_circle_is_reported() -> None:
    assert used_by("use crate::tape::Tape; // crate::model\n#[cfg(test)] use crate::python;") == {"tape"}
    with pytest.raises(graphlib.CycleError):
        tuple(graphlib.TopologicalSorter({"model": {"tape"}, "tape": {"model"}}).static_order())
