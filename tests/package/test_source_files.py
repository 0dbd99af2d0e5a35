"""Sources: rustfmt reaches every Rust file, and every type that a docstring names exists."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import udd

ROOT = Path(__file__).parents[2]
PACKAGE = Path(udd.__file__).parent

# Words of a type's description that begin with a capital letter and name no class of ours.
WORDS = {"Axes3D", "Generator", "SymPy", "NaN", "U", "V"}


def rust_files(folder: Path, entry: str) -> Iterator[Path]:
    """Yield the files that rustfmt reaches: it follows the `mod` lines outside of macros."""
    file = folder / entry
    yield file
    names = re.findall(r"^(?:pub(?:\([^)]*\))? )?mod (\w+);", file.read_text(encoding="utf-8"), re.MULTILINE)
    parent = folder if entry in {"lib.rs", "main.rs", "mod.rs"} else folder / file.stem
    for name in names:
        as_folder = (parent / name / "mod.rs").exists()
        yield from rust_files(*((parent / name, "mod.rs") if as_folder else (parent, f"{name}.rs")))


@pytest.mark.parametrize(("folder", "entry"), [("rust", "lib.rs"), ("tests/core", "main.rs")])
def test_rustfmt_reaches_every_rust_file(folder: str, entry: str) -> None:
    if not (ROOT / folder).is_dir():
        pytest.skip("needs the sources of the core")
    reached = set(rust_files(ROOT / folder, entry))
    assert sorted(str(file.relative_to(ROOT)) for file in set((ROOT / folder).rglob("*.rs")) - reached) == []


def defined_names(tree: ast.Module) -> Iterator[str]:
    """Yield the names that a file defines or imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))


def documented_types(tree: ast.Module) -> Iterator[str]:
    """Yield each `name : Type` of the docstrings whose type names a class."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
            for line in re.findall(r"^\s*\w[\w*, ]* : .+$", ast.get_docstring(node) or "", re.MULTILINE):
                yield line.strip()


def test_a_documented_type_exists() -> None:
    # A textual rename once left the type `Trial` in the docstring of a class that takes `TrialFit`.
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py")}
    stub = ast.parse((PACKAGE / "_core.pyi").read_text(encoding="utf-8"))
    existing = {name for tree in (*trees.values(), stub) for name in defined_names(tree)}
    existing |= WORDS | set(dir(builtins))
    missing = [
        f"{path.relative_to(PACKAGE)}: {line}"
        for path, tree in trees.items()
        for line in documented_types(tree)
        for name in re.findall(r"(?<![\w.\"])[A-Z]\w*", line.split(" : ", 1)[1])
        if name not in existing
    ]
    assert missing == []
