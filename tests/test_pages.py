"""Pages for people who contribute: they are there, whole, and of one version."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

import houseexpo

ROOT = Path(__file__).parents[1]


def test_the_citation_is_whole_and_of_this_version() -> None:
    said = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= said.keys()
    assert said["version"] == houseexpo.__version__


def test_the_changelog_keeps_its_form() -> None:
    text = (ROOT / "CHANGELOG.md").read_text()
    versions = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert versions[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[(Unreleased|\d+\.\d+\.\d+)\]( - \d{4}-\d\d-\d\d)?", line) for line in versions)
    kinds = set(re.findall(r"^### (.*)$", text, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_files_that_pages_on_the_code_name_exist() -> None:
    known = {
        path.name
        for root in ("houseexpo", "pipeline", "stats", "research", "tests")
        for path in (ROOT / root).rglob("*.*")
    }
    for name in ("architecture.md", "algorithm.md", "simulator.md"):
        named = set(re.findall(r"`(?:[\w/]+/)?(\w+\.(?:py|toml|css|js))`", (ROOT / "docs" / name).read_text()))
        assert len(named) > 5 or name != "architecture.md"
        assert named - {"pyproject.toml"} <= known, (name, sorted(named - known))


def test_the_page_on_installing_has_a_row_for_each_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    rows = re.findall(r"^\| `([\w-]+)` \|", (ROOT / "docs" / "installation.md").read_text(), re.MULTILINE)
    wanted = {name for name, needs in extras.items() if needs and name not in {"dev", "docs"} and "tests" not in name}
    assert sorted(rows) == sorted(wanted)


def test_a_term_stands_in_the_glossary_once() -> None:
    terms = re.findall(r"^\| \*\*(.+?)\*\*", (ROOT / "docs" / "glossary.md").read_text(), re.MULTILINE)
    assert len(terms) > 40
    assert len(terms) == len(set(terms))
