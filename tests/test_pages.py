"""Pages for people who contribute: they are there, whole, and of one version."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import houseexpo
from houseexpo.commands.arguments import POLICIES
from houseexpo.commands.benchmark import TRACK_NAMES
from houseexpo.exports import FORMATS
from houseexpo.pseudoslam.agents.loading import NAMES
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, TRACKS

ROOT = Path(__file__).parents[1]


def test_the_citation_is_whole_and_of_this_version() -> None:
    said = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= said.keys()
    assert said["version"] == houseexpo.__version__


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


# The page of all commands says what the code says.


DOCS = Path(__file__).resolve().parents[1] / "docs"


def test_the_page_is_the_one_that_the_code_makes() -> None:
    spec = importlib.util.spec_from_file_location("commands_page", DOCS / "scripts" / "commands.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (DOCS / "commands.md").read_text() == module.page(), "run: python docs/scripts/commands.py"


def test_completion_knows_all_policies_and_tracks() -> None:
    assert list(POLICIES) == list(NAMES)
    assert list(TRACK_NAMES) == [track.name for track in (*TRACKS, *MAP_TRACKS)]


@pytest.mark.parametrize("page", ["README.md", "docs/guide-library.md"])
def test_the_pages_count_the_formats_right(page: str) -> None:
    assert re.findall(r"(\d+) formats", (DOCS.parent / page).read_text()) == [str(len(FORMATS))]
