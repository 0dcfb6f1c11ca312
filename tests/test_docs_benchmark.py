"""The page of the benchmark does what it says, and the leaderboard is made from the results beside it."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from houseexpo.dataset.fetch import subset_folder
from houseexpo.pseudoslam.agents.loading import NAMES
from houseexpo.pseudoslam.benchmark.cases import ids_sha256, read_test_ids
from houseexpo.pseudoslam.benchmark.comparison import BOUND, read_results
from houseexpo.pseudoslam.benchmark.page import assign_colours, colour_keys, draw_map_panels
from houseexpo.pseudoslam.benchmark.tables import format_markdown
from houseexpo.pseudoslam.benchmark.tracks import BUDGETS, MAP_TRACKS, TRACKS
from tests.builders.commands import call
from tests.builders.simulations import hut
from tests.houseexpo.pseudoslam.benchmark.test_benchmark_cases import data_set
from tests.journeys.pages import blocks

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "docs" / "benchmark-exploration.md"
PAGE = FILE.read_text()
RESULTS = ROOT / "docs" / "leaderboard"


@pytest.mark.slow
def test_the_recipes_run_as_they_are_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    subset_folder("all").parent.mkdir(parents=True, exist_ok=True)
    data_set(subset_folder("all"), {"test": [hut(f"hut_{i}", 2.0 + 0.1 * i) for i in range(20)]})
    policy, interface = blocks(FILE, "python")
    (tmp_path / "my_policy.py").write_text(policy)
    exec(compile(interface, "interface", "exec"), {})  # noqa: S102  # it is the page's
    commands = [line for block in blocks(FILE, "") for line in block.splitlines()]
    assert len(commands) == 5
    for command in commands:
        call(*shlex.split(command)[1:])
    assert {"page.md", "mine.json"} <= {file.name for file in tmp_path.iterdir()}
    assert "| my_policy.py |" in (tmp_path / "page.md").read_text()


def test_every_track_and_policy_has_its_row() -> None:
    assert re.findall(r"^\| `([\w-]+)` \| `([\w-]+)` \|", PAGE, re.MULTILINE) == [(t.name, t.id) for t in TRACKS]
    told = PAGE.split("## The policies that come with houseexpo\n")[1].split("\n## ")[0]
    names = [
        name for row in re.findall(r"^\| (`.*?) \|", told, re.MULTILINE) for name in re.findall(r"`([\w-]+)`", row)
    ]
    assert names == list(NAMES)
    assert "100, 200, 400 and 800 steps" in PAGE
    assert BUDGETS == (100, 200, 400, 800)


@pytest.mark.slow
def test_the_leaderboard_is_made_from_the_results() -> None:
    page = (ROOT / "docs" / "leaderboard.md").read_text()
    found = read_results([RESULTS])
    pictures = {
        (each.track.id, over): f"leaderboard/{each.track.id}-{over}.svg"
        for each in found
        for over, _ in each.track.curves
    }
    of_maps = {
        each.track.id: [
            (about, f"leaderboard/{each.track.id}-maps-{number}.svg")
            for number, (about, _) in enumerate(draw_map_panels(each), start=1)
        ]
        for each in found
    }
    assert page == format_markdown(found, "Leaderboard", pictures, of_maps)
    linked = {*pictures.values(), *(link for links in of_maps.values() for _, link in links)}
    assert linked == {f"leaderboard/{file.name}" for file in RESULTS.glob("*.svg")}
    colours = assign_colours(found)
    for each in found:
        drawn = [colours[key] for key in colour_keys(each) if key in colours]
        assert len(set(drawn)) == len(drawn), f"{each.track.id}: two rows have one colour"


def test_the_results_are_of_the_plans_that_are_written_down() -> None:
    files = sorted(RESULTS.glob("*.json"))
    assert len(files) >= 2
    for compared in read_results(files):
        for result in (result for entry in compared.entries for result in entry.results):
            if compared.track.name == "roomgoal":  # those of them that have goals
                assert set(result.episodes["plan"]) <= set(read_test_ids()[:500])
            elif (
                compared.track.needs_plans and compared.track not in MAP_TRACKS and compared.track.name != "objectgoal"
            ):
                written = read_test_ids("large" if compared.track.largest else "test")
                assert result.plans.ids_sha256 == ids_sha256(written[: result.plans.number])
            if result.policy.name == BOUND:
                assert result.policy.source == "research.way_bounds"
                continue
            if result.policy.name not in NAMES:  # what was learned, by its file
                assert (ROOT / result.policy.name).is_file()
                continue
            # where it stood when it ran; modules may have been merged since
            assert result.policy.source.startswith("houseexpo.pseudoslam.agents.")
            assert f"{result.track_id}-{result.policy.name}.json" in {file.name for file in files}
