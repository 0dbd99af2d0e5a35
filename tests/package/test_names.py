"""Names say what they hold: pronouns and participles are not allowed beyond a few lines."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "python" / "udd"
UNTELLING = {"found", "told", "apart", "held", "kin", "one", "own", "known", "near", "both", "more"}
SHORT = 5  # lines
#: Public names, which stay, and one that the compiled core reads.
KEPT = {
    "Film.held",
    "FormulaModel._own",
    "MoreOptions.apart",
    "Section.found",
    "TrackOptions.apart",
    "TrackedFrame.held",
    "equilibria.near",
    "lifetimes.near",
    "page.found",
    "track.more",
}
Scope = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef
Node = ast.AST


def is_old_name(node: Node) -> bool:
    """Return True if a node keeps an old name for one release."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and isinstance(node.value.func, ast.Name)
        and node.value.func.id == "renamed_attribute"
    )


def inside(scope: Node) -> Iterator[Node]:
    """Yield the nodes of a scope; of scopes within it only their first node."""
    for node in ast.iter_child_nodes(scope):
        yield node
        if not isinstance(node, Scope) and not is_old_name(node):
            yield from inside(node)


def bindings(scope: Node) -> dict[str, int]:
    """Return the names that a scope binds, with their first lines."""
    names: dict[str, int] = {}
    if isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
        for argument in ast.walk(scope.args):
            if isinstance(argument, ast.arg):
                names.setdefault(argument.arg, argument.lineno)
    for node in inside(scope):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.setdefault(node.id, node.lineno)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.setdefault(node.name, node.lineno)
    return names


def untelling(source: str) -> list[str]:
    """Return the names of the list that live longer than five lines, with line and scope."""
    result = []
    tree = ast.parse(source)
    for scope in ast.walk(tree):
        if not isinstance(scope, Scope | ast.Module):
            continue
        for name, first in bindings(scope).items():
            if name.strip("_") not in UNTELLING:
                continue
            used = [n.lineno for n in ast.walk(scope) if isinstance(n, ast.Name) and n.id == name]
            lives = max([first, *used]) - min([first, *used]) + 1
            if lives > SHORT or isinstance(scope, ast.ClassDef | ast.Module):
                result.append(f"{first}: {getattr(scope, 'name', 'module')}.{name}")
    return [fault for fault in result if fault.split()[1] not in KEPT]


def test_a_pronoun_is_reported_if_it_lives_longer_than_five_lines() -> None:
    lines = ["def f(x):", "    found = x", *["    x += 1"] * 3, "    return found"]
    assert untelling("\n".join(lines)) == []
    lines.insert(3, "    x += 1")
    assert untelling("\n".join(lines)) == ["2: f.found"]
    assert untelling("class A:\n    own = 1\n") == ["2: A.own"]
    assert untelling("def f(told):\n    return [\n\n\n\n\ntold]\n") == ["1: f.told"]


def test_no_pronoun_lives_longer_than_five_lines() -> None:
    faults = [
        f"{path.relative_to(PACKAGE)}:{fault}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for fault in untelling(path.read_text(encoding="utf-8"))
    ]
    assert faults == []
