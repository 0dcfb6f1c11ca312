"""The page of all commands says what the code says."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from houseexpo.commands.arguments import POLICIES
from houseexpo.commands.benchmark import TRACK_NAMES
from houseexpo.exports import FORMATS
from houseexpo.pseudoslam.agents.loading import NAMES
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, TRACKS

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
