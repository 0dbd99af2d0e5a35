"""The files for packagers agree with the project's own."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["package"]["version"]


def names(requirements: list[str]) -> set[str]:
    return {re.split(r"[\[<>=!~ ;]", item)[0].lower().replace("_", "-") for item in requirements}


def test_codemeta_says_what_the_project_says() -> None:
    said = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    assert said["version"] == VERSION
    assert {item.replace("_", "-") for item in said["softwareRequirements"]} == names(PROJECT["dependencies"])
    assert set(said["keywords"]) == set(PROJECT["keywords"])


def test_the_conda_recipe_has_the_dependencies() -> None:
    recipe = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    run = recipe.partition("  run:\n")[2].partition("\ntests:")[0]
    there = names([line.strip(" -") for line in run.splitlines() if line.strip()])
    assert there == {"python", "matplotlib-base", *names(PROJECT["dependencies"])} - {"matplotlib"}
    assert VERSION.replace("-dev", ".dev0") in recipe


def test_all_brings_every_extra_and_none_is_written_twice() -> None:
    extras = PROJECT["optional-dependencies"]
    brought = set(re.findall(r"\[(.*)\]", extras["all"][0])[0].split(","))
    assert brought == set(extras) - {"all", "docs"}
    assert not names(extras["track"]) & names(extras["app"])


def test_the_paper_cites_what_its_list_has() -> None:
    text = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(), re.MULTILINE))
    assert set(re.findall(r"\[@(\w+)\]", text)) == entries
    made = (ROOT / "paper" / "figures.py").read_text(encoding="utf-8")
    assert all(f'"{name}"' in made for name in re.findall(r"\]\((\w+\.png)\)", text))


def test_the_release_checks_its_wheel_on_the_oldest_and_the_newest_python() -> None:
    workflow = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    wheel = workflow.partition("  wheel:\n")[2].partition("  sdist:\n")[0]
    oldest = re.search(r">=(3\.\d+)", PROJECT["requires-python"])
    assert oldest is not None and f'"{oldest[1]}"' in wheel
    assert '"3.14"' in wheel and "packaging/check_wheel.py" in wheel
