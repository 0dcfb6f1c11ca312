"""The page about a build shows first what a person should look at."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from houseexpo.dataset.store.folders import rejected_picture_path
from houseexpo.drawing import svg
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.batch.assemble import BuildResult
from pipeline.html_report import write_report
from pipeline.terminal_report import (
    doubt_lines,
    duplicate_lines,
    next_commands,
    notes_lines,
    read_index_rows,
    slowest_inputs,
    stage_seconds,
)
from stats.summary import PlanSummary
from tests.builders.batch import doubting, one_room, run_build


def _quiet(what: str, done: int, total: int) -> None:
    """Show nothing."""


@pytest.fixture
def street(tmp_path: Path) -> Path:
    for i, name in enumerate(("a_sure_95", "b_sure_70", "c_sure_20", "d_refuse", "e")):
        one_room(tmp_path / "street" / f"{name}.ply", 4.0 + i)
    (tmp_path / "street" / "empty.stl").touch()
    return tmp_path / "street"


def _page(data_set: BuildResult) -> str:
    write_report(data_set, _quiet)
    return (data_set.root / ".build" / "report.html").read_text()


def test_doubtful_plans_come_first_then_rejections_then_the_rest(street: Path, tmp_path: Path) -> None:
    page = _page(run_build([street], tmp_path / "out", plan=doubting))
    headings = ["Doubtful plans: 2", "Rejected: 2", "Plans", "Time"]
    assert re.findall("<h2>(.*?)</h2>", page) == headings
    captions = [caption.split("<br>") for caption in re.findall("<figcaption>(.*?)</figcaption>", page)]
    assert [caption[0] for caption in captions] == [
        "c_sure_20",
        "b_sure_70",
        "layout: not_enclosed: 1",
        "source: empty: 1",
        "a_sure_95",
        "e",
    ]
    assert captions[0][1:] == ["quality 0.20", "doors that are cuts, not evidence: 0.50"]
    assert captions[2][1:3] == ["for example d_refuse", "street/d_refuse.ply"]
    assert captions[4][1:] == ["quality 0.95"]
    pictures = re.findall('<img src="(.*?)"', page)
    assert pictures[2].startswith("data:image/png;base64,iVBOR")
    assert all((tmp_path / "out" / ".build" / name).stat().st_size > 500 for name in pictures[:2] + pictures[3:])


@pytest.mark.slow
def test_pictures_of_what_was_refused_are_kept_for_the_service(street: Path, tmp_path: Path) -> None:
    data_set = run_build([street], tmp_path / "out")
    _page(data_set)
    kept = tmp_path / "out" / ".build" / "pictures" / "refused"
    assert [each.id for each in data_set.refused] == ["d_refuse", "empty"]
    assert list(kept.iterdir()) == [
        rejected_picture_path(data_set.root, "d_refuse")
    ]  # nothing was found in the empty file
    assert next(kept.iterdir()).read_bytes() == data_set.refused[0].picture != b""
    (street / "d_refuse.ply").unlink()
    _page(run_build([street], tmp_path / "out"))
    assert not any(kept.iterdir())


def test_every_rejected_input_is_listed_with_its_file_and_what_to_do(street: Path, tmp_path: Path) -> None:
    page = _page(run_build([street], tmp_path / "out"))
    rows = [re.findall("<td>([^<]*)", row) for row in re.findall("<tr>(.*)", page)]
    assert ["d_refuse", "street/d_refuse.ply", "layout: not_enclosed", "as asked", "ask for something else"] in rows
    assert any(row[:3] == ["empty", "street/empty.stl", "source: empty"] for row in rows)


def test_a_duplicate_is_shown_beside_the_plan_that_it_repeats(tmp_path: Path) -> None:
    for name in ("a", "b"):
        one_room(tmp_path / "street" / f"{name}.ply")
    page = _page(run_build([tmp_path / "street"], tmp_path / "out"))
    assert "<h2>Duplicates: 1</h2>" in page
    pair = re.search('<figure><a href="(.*?)">.*?<a href="(.*?)">.*?b repeats a', page)
    assert pair is not None
    assert pair.groups() == ("pictures/b.png", "pictures/a.svg")
    assert all((tmp_path / "out" / ".build" / picture).is_file() for picture in pair.groups())


@pytest.mark.slow
def test_the_time_of_each_stage_and_the_longest_inputs_are_told(tmp_path: Path) -> None:
    one_room(tmp_path / "a.ply")
    data_set = run_build([tmp_path / "a.ply"], tmp_path / "out", plan=plan_level)
    stages = list(stage_seconds(data_set))
    assert stages[:4] == ["source", "evidence", "planes", "layout"]
    assert stages[-1] == "plan"
    ((name, file, seconds),) = slowest_inputs(data_set)
    assert name.endswith("_a")
    assert file == "a.ply"
    assert 0 < sum(stage_seconds(data_set).values()) <= seconds


def test_what_was_ignored_is_said_with_what_to_do(street: Path, tmp_path: Path) -> None:
    for name in ("notes.txt", "wall.PNG", "villa.FBX", "tower.skp"):
        (street / name).touch()
    (told,) = notes_lines(run_build([street], tmp_path / "out"))
    assert told.startswith("ignored, no houses by themselves: 1 .fbx, 1 .png, 1 .skp, 1 .txt; export .skp as")


def test_the_terminal_says_what_speaks_against_doubtful_plans(street: Path, tmp_path: Path) -> None:
    built = run_build([street], tmp_path / "out", plan=doubting)
    lines = [line.plain for line in doubt_lines(read_index_rows(built.root))]
    assert [line.partition(":")[0] for line in lines] == ["doubtful b_sure_70", "doubtful c_sure_20"]
    assert all(line.partition(": ")[2] for line in lines)


def test_the_terminal_says_which_plans_repeat_others_and_how_to_keep_them(tmp_path: Path) -> None:
    for name in ("one", "two"):
        one_room(tmp_path / "street" / f"{name}.ply", 4.0)
    built = run_build([tmp_path / "street"], tmp_path / "out")
    assert [line.plain.strip() for line in duplicate_lines(built)] == [
        "duplicate two: its plan repeats one",
        "left out; --keep-copies keeps them, `keep = true` under an id in overrides.toml one of them",
    ]


def test_the_commands_to_run_next_can_be_pasted_where_names_have_spaces(tmp_path: Path) -> None:
    one_room(tmp_path / "street" / "one.ply", 4.0)
    built = run_build([tmp_path / "street"], tmp_path / "my plans")
    assert shlex.split(next_commands(built, "my plans")[1])[-2:] == ["--out", "my plans.png"]
    assert next_commands(built, "Pläne")[1].endswith("--out 'Pläne.png'")


def test_a_plan_that_cannot_be_drawn_or_measured_costs_nothing_else(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def draw(plan: FloorPlan, **options: int) -> str:
        if plan.id == "c_sure_20":
            raise ValueError("grid: too many cells")
        return svg(plan, **options)

    def add(self: PlanSummary, plan: FloorPlan) -> None:
        if plan.id == "b_sure_70":
            raise ValueError("no numbers")
        whole_add(self, plan)

    whole_add = PlanSummary.add
    monkeypatch.setattr("pipeline.html_report.svg", draw)
    monkeypatch.setattr(PlanSummary, "add", add)
    data_set = run_build([street], tmp_path / "out", plan=doubting)
    page = _page(data_set)
    assert data_set.stats["outcomes"]["plans"] == 4
    assert data_set.stats["outcomes"]["unmeasured"] == 1
    assert "c_sure_20" in page
    pictures = {file.name for file in (data_set.root / ".build" / "pictures").glob("*.*")}
    assert pictures == {"a_sure_95.svg", "b_sure_70.svg", "e.svg", "sheet.svg"}
    assert "c_sure_20: it cannot be drawn: grid: too many cells" in caplog.text
    assert "b_sure_70: it is left out of the statistics: no numbers" in caplog.text
