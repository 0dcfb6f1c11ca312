"""The page about a build shows first what a person should look at."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.report import outcome_table
from pipeline.report_page import doubtful_ids, write_report
from tests.builders.batch import one_room, run_build
from tests.builders.doubts import doubting


def _quiet(what: str, done: int, total: int) -> None:
    """Show nothing."""


@pytest.fixture
def street(tmp_path: Path) -> Path:
    for i, name in enumerate(("a_sure_95", "b_sure_70", "c_sure_20", "d_refuse", "e")):
        one_room(tmp_path / "street" / f"{name}.ply", 4.0 + i)
    (tmp_path / "street" / "empty.stl").touch()
    return tmp_path / "street"


def test_doubtful_plans_come_first_then_rejections_with_pictures_then_the_rest(street: Path, tmp_path: Path) -> None:
    data_set = run_build([street], tmp_path / "out", plan=doubting)
    assert doubtful_ids(data_set) == ["c_sure_20", "b_sure_70"]
    write_report(data_set, _quiet)
    page = (tmp_path / "out" / ".build" / "report.html").read_text()
    assert re.findall("<h2>(.*?)</h2>", page) == ["Doubtful plans: 2", "Rejected: 2", "Plans"]
    captions = re.findall("<figcaption>(.*?)</figcaption>", page)
    assert [caption.split("<br>")[0] for caption in captions] == [
        "c_sure_20",
        "b_sure_70",
        "d_refuse",
        "a_sure_95",
        "e",
    ]
    assert captions[0].split("<br>")[1:] == ["quality 0.20", "doors that are cuts, not evidence: 0.50"]
    assert captions[3].split("<br>")[1:] == ["quality 0.95"]
    assert captions[4] == "e"
    assert "layout: not_enclosed" in captions[2]
    pictures = re.findall('<img src="(.*?)"', page)
    assert pictures[2].startswith("data:image/png;base64,iVBOR")
    assert all((tmp_path / "out" / ".build" / name).stat().st_size > 500 for name in pictures[:2] + pictures[3:])


def test_a_build_without_doubts_says_nothing_of_them(tmp_path: Path) -> None:
    one_room(tmp_path / "a.ply")
    data_set = run_build([tmp_path / "a.ply"], tmp_path / "out")
    write_report(data_set, _quiet)
    page = (tmp_path / "out" / ".build" / "report.html").read_text()
    assert re.findall("<h2>(.*?)</h2>", page) == ["Plans"]
    assert "doubtful" not in str([list(column.cells) for column in outcome_table(data_set.stats).columns])


def test_the_table_counts_the_doubtful(street: Path, tmp_path: Path) -> None:
    table = outcome_table(run_build([street], tmp_path / "out", plan=doubting).stats)
    names, counts = (list(column.cells) for column in table.columns)
    assert dict(zip(names, counts, strict=True))["  doubtful: quality below 0.8"] == "2"
