"""Promises of the public docstrings (numpydoc); pytest's doctest runs their examples."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import NumpyDocString
from numpydoc.validate import validate

import udd

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PACKAGE = ROOT / "python" / "udd"
MODULES = ("udd", *(f"udd.{name}" for name in udd.__all__ if inspect.ismodule(getattr(udd, name))))
FUNCTIONS = [name for name in udd.__all__ if inspect.isfunction(getattr(udd, name))]
CLASSES = [name for name in udd.__all__ if inspect.isclass(getattr(udd, name))]

# numpydoc's own codes: a docstring at all, its sections in order, every parameter described, none that
# does not exist, what is returned, an example.
OF_ALL = {"GL07", "GL08", "PR02", "PR03", "PR10"}
OF_A_FUNCTION = OF_ALL | {"PR01", "RT01", "EX01"}

#: A first line begins with none of these words, as a phrase about an action or a thing does not.
CLAUSE = {"what", "whatever", "whether", "how", "where", "when", "which", "who", "why", "if", "as"}
CLAUSE |= {"of", "for", "from", "by", "in"}
ARTICLE = {"the", "a", "an", "all", "each", "every", "those", "it", "its"}


def faults(name: str, codes: set[str]) -> list[str]:
    return [f"{code}: {text}" for code, text in validate(f"udd.{name}")["errors"] if code in codes]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_is_documented(name: str) -> None:
    assert faults(name, OF_A_FUNCTION) == []


@pytest.mark.parametrize("name", CLASSES)
def test_a_public_class_is_documented(name: str) -> None:
    assert faults(name, OF_ALL) == []


def on_reference_pages() -> list[str]:
    """Return the names on the pages of the reference."""
    pages = sorted((DOCS / "api").glob("*.md"))
    return [n for page in pages for n in re.findall(r"^   (udd\.[\w.]+)$", page.read_text("utf-8"), re.M)]


@functools.cache
def resolved(name: str) -> Any:
    """Return the object with a dotted name."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            answer: Any = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            answer = getattr(answer, part)
        return answer
    raise AttributeError(name)


@functools.cache
def public() -> dict[str, Any]:
    """Return all public functions and classes of the package, each once, by name."""
    named = {f"{module}.{n}" for module in MODULES for n in getattr(resolved(module), "__all__", ())}
    objects: dict[int, tuple[str, Any]] = {}
    for name in sorted(named | set(on_reference_pages())):
        value = getattr(resolved(name.rpartition(".")[0]), name.rpartition(".")[2])
        if callable(value):
            objects.setdefault(id(value), (name, value))
    return dict(objects.values())


def members(name: str, cls: type) -> Iterator[tuple[str, Any]]:
    """Yield the public methods and properties that a class defines."""
    for key, value in vars(cls).items():
        if isinstance(value, staticmethod | classmethod):
            value = value.__func__
        if not key.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
            yield f"{name}.{key}", value


def described() -> Iterator[tuple[str, Any, Any]]:
    """Yield everything public with a docstring: its name, itself, and the parsed docstring."""
    for name, value in public().items():
        yield name, value, NumpyDocString(inspect.getdoc(value) or "")
        if inspect.isclass(value):
            for member, method in members(name, value):
                yield member, method, NumpyDocString(inspect.getdoc(method) or "")


def first_line_fault(summary: str, is_action: bool) -> str:
    """Return what is wrong with a first line; of functions it is an imperative phrase, else a noun phrase."""
    word = re.sub(r"\W.*", "", summary).lower()
    if not summary:
        return "no docstring"
    if word in CLAUSE or (is_action and (word in ARTICLE or (word.endswith("s") and word[-2] not in "su"))):
        return summary
    return "" if summary.endswith(".") else f"{summary} (no full stop)"


@pytest.mark.parametrize(
    ("summary", "is_action", "good"),
    [
        ("Compute the spectrum.", True, True),
        ("Compress the file.", True, True),
        ("Return True if the orbit is bounded.", True, True),
        ("Computes the spectrum.", True, False),
        ("The spectrum of an orbit.", True, False),
        ("How far the model diverges.", True, False),
        ("Spectrum of an orbit.", False, True),
        ("The drive speed.", False, True),
        ("Whether the disk was tracked.", False, False),
        ("Spectrum of an orbit", False, False),
        ("", False, False),
    ],
)
def test_first_lines_are_judged(summary: str, is_action: bool, good: bool) -> None:
    assert (first_line_fault(summary, is_action) == "") is good


def test_first_lines_are_imperative_or_noun_phrases() -> None:
    bad = {
        name: fault
        for name, value, doc in described()
        if (fault := first_line_fault(" ".join(doc["Summary"]), inspect.isfunction(value)))
    }
    assert bad == {}


def is_property(node: ast.AST) -> bool:
    """Return True if a definition is read like an attribute."""
    decorators = getattr(node, "decorator_list", [])
    return any("property" in ast.unparse(decorator) for decorator in decorators)


def first_line_faults(source: str) -> list[str]:
    """Return the first lines of docstrings that are no phrases, with the lines of their definitions."""
    result = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        summary = (ast.get_docstring(node) or "").partition("\n")[0]
        is_action = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not is_property(node)
        word = re.sub(r"\W.*", "", summary).lower()
        if word in CLAUSE or (is_action and word in ARTICLE):
            result.append(f"{getattr(node, 'lineno', 1)}: {summary}")
    return result


def test_first_lines_of_a_source_are_judged() -> None:
    assert first_line_faults('def f():\n    """The number of points."""\n') == ["1: The number of points."]
    assert first_line_faults('class A:\n    """How it moves."""\n') == ["1: How it moves."]
    assert first_line_faults('"""Where it moves."""\n') == ["1: Where it moves."]
    assert first_line_faults('@property\ndef f():\n    """The number of points."""\n') == []
    assert first_line_faults('def f():\n    """Count the points."""\n') == []


def test_first_lines_of_all_docstrings_are_phrases() -> None:
    faults = [
        f"{path.relative_to(PACKAGE)}:{fault}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for fault in first_line_faults(path.read_text(encoding="utf-8"))
    ]
    assert faults == []


def parameters(function: Callable[..., Any]) -> list[str]:
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def documented(doc: Any) -> set[str]:
    entries = doc["Parameters"] + doc["Other Parameters"]
    return {part.strip().lstrip("*") for entry in entries for part in entry.name.split(",")}


def test_functions_and_methods_describe_their_parameters_and_result() -> None:
    missing = {}
    for name, value, doc in described():
        if not inspect.isfunction(value):
            continue
        absent = [n for n in parameters(value) if n not in documented(doc)]
        returns = inspect.signature(value).return_annotation not in (None, "None")
        if returns and not (doc["Returns"] or doc["Yields"]):
            absent.append("Returns")
        if absent:
            missing[name] = absent
    assert missing == {}


def names_beside(doc: Any) -> list[str]:
    """Return the names in the section See Also."""
    return [name for functions, _ in doc["See Also"] for name, _ in functions]


def has_no_neighbour(value: Any) -> bool:
    """Return True for errors and warnings: their message says what to do."""
    return inspect.isclass(value) and issubclass(value, BaseException)


def test_every_public_function_and_class_names_its_neighbours() -> None:
    alone = [
        name
        for name, value in public().items()
        if not has_no_neighbour(value) and not NumpyDocString(inspect.getdoc(value) or "")["See Also"]
    ]
    assert alone == []


def is_name(reference: str, owner: str) -> bool:
    """Return True if a reference resolves: as it stands, in the package, or in its owner's module."""
    for prefix in ("", "udd.", f"{owner.rpartition('.')[0]}."):
        try:
            resolved(prefix + reference)
        except (AttributeError, ImportError):
            continue
        return True
    return False


def test_every_neighbour_exists() -> None:
    assert is_name("udd.plot.orbit", "udd.fit") and is_name("Fit.budget", "udd.fit")
    assert not is_name("udd.plot.orbits", "udd.fit")
    dead = [f"{n}: {ref}" for n, _, doc in described() for ref in names_beside(doc) if not is_name(ref, n)]
    assert dead == []


#: A number after a word or a full stop and a space: [1] of an index follows its name without a space.
CITED = re.compile(r"(?<=[\w.,)\"”] )\[(\d+)\](?!\])")


def entries() -> set[int]:
    text = (DOCS / "references.md").read_text(encoding="utf-8")
    return {int(number) for number in re.findall(r"^(\d+)\. ", text, re.M)}


def test_every_cited_number_is_an_entry_of_the_references() -> None:
    known_numbers = entries()
    cited = {
        (name, int(number))
        for name, value, _ in described()
        for number in CITED.findall(re.sub(r">>>.*", "", inspect.getdoc(value) or ""))
    }
    assert len(cited) > 20
    assert {(name, number) for name, number in cited if number not in known_numbers} == set()


def test_the_references_are_numbered_without_a_gap() -> None:
    assert entries() == set(range(1, len(entries()) + 1))
