"""Which plans need a look, and data sets with plans that cannot be read."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.commands.arguments import parse_ids
from houseexpo.dataset import open_dataset
from houseexpo.floorplan import FloorPlan, save_plan
from stats.bad_plans import BadPlan, find_bad_plans
from stats.measure import measure_plans
from tests.builders.batch import one_room, run_build
from tests.stats.conftest import outline


def call(*words: str | Path, code: int = 0) -> tuple[str, str]:
    done = CliRunner().invoke(make_app(), [str(word) for word in words], env={"COLUMNS": "200"})
    assert done.exit_code == code, done.output
    return done.stdout, done.stderr


def dumbbell() -> FloorPlan:
    """Two halls of 4 x 4 m and a passage between them that is 0.5 m wide."""
    x = [0.1, 4.1, 6.1, 10.1]
    ring = [(x[0], 0.1), (x[0], 4.1), (x[1], 4.1), (x[1], 2.35), (x[2], 2.35), (x[2], 4.1), (x[3], 4.1), (x[3], 0.1)]
    ring += [(x[2], 0.1), (x[2], 1.85), (x[1], 1.85), (x[1], 0.1)]
    return FloorPlan("dumbbell", ring, 2, {})


def bow() -> FloorPlan:
    """A ring that crosses itself."""
    return FloorPlan("bow", [(0.1, 0.1), (4.1, 4.1), (4.1, 0.1), (0.1, 4.1)], 1, {})


@pytest.fixture
def odd(folder: Path) -> Path:
    """The data set of five outlines, of which h4 repeats h3, with a dumbbell and a bow."""
    for plan in (dumbbell(), bow()):
        save_plan(plan, folder / f"{plan.id}.json")
    return folder


def found(folder: Path, radius_m: float) -> dict[str, BadPlan]:
    data_set = open_dataset(folder)
    return {bad.id: bad for bad in find_bad_plans(data_set, measure_plans(data_set, workers=1), radius_m, workers=1)}


def test_a_plan_is_bad_for_a_robot_that_is_wider_than_its_passage(odd: Path) -> None:
    assert "dumbbell" not in found(odd, 0.2)
    for radius_m in (0.3, 0.27):  # the records have the first; the second is measured
        assert found(odd, radius_m)["dumbbell"] == BadPlan("dumbbell", 2, 0.5)


def test_rings_and_repeats_are_bad_for_every_robot(odd: Path) -> None:
    bad = found(odd, 0.2)
    assert set(bad) == {"bow", "h4"}
    assert bad["h4"] == BadPlan("h4", repeats="h3")
    assert bad["bow"].ring == "crosses"
    assert list(bad["bow"].reasons(0.2))[-1] == "invalid ring: crosses itself"


def test_a_mirrored_plan_repeats_the_first_and_a_house_where_no_robot_fits_is_bad(tmp_path: Path) -> None:
    save_plan(replace(dumbbell(), id="a"), tmp_path / "a.json")
    save_plan(FloorPlan("b", [(y, x) for x, y in dumbbell().verts[::-1]], 2, {}), tmp_path / "b.json")
    save_plan(outline("slit", 4.0, 0.3), tmp_path / "slit.json")
    bad = found(tmp_path, 0.2)
    assert bad["b"] == BadPlan("b", repeats="a")
    assert list(bad["slit"].reasons(0.2)) == ["a robot of 0.20 m fits nowhere"]


def test_the_list_is_lines_with_the_id_first_or_json(odd: Path, tmp_path: Path) -> None:
    text, _ = call("stats", odd, "--list-bad", "--radius", "0.3", "--workers", "1")
    line = next(line for line in text.splitlines() if line.startswith("dumbbell"))
    assert line == "dumbbell\tnot connected for a robot of 0.30 m: 2 pieces, 50% in the largest"
    (tmp_path / "bad.txt").write_text(text)
    assert parse_ids([f"@{tmp_path / 'bad.txt'}"]) == ["bow", "dumbbell", "h4"]
    call("show", odd, "--ids", f"@{tmp_path / 'bad.txt'}", "--out", tmp_path / "bad.svg", "--size", "100")
    said = json.loads(call("stats", odd, "--list-bad", "--radius", "0.3", "--json", "--workers", "1")[0])
    assert {"id": "dumbbell", "pieces": 2, "largest_share": 0.5} in said["bad"]
    assert {"id": "h4", "repeats": "h3"} in said["bad"]
    assert said["broken"] == []


@pytest.mark.slow
def test_a_broken_plan_is_counted_and_named_and_the_others_count(folder: Path, tmp_path: Path) -> None:
    (folder / "cut_off.json").write_text('{"verts": [[0.1')
    (folder / "twin.json").write_bytes((folder / "h0.json").read_bytes())
    text, said = call("stats", folder, "--json", "--workers", "1", "--out", tmp_path / "report.html")
    values = json.loads(text)
    assert values["data_set"] == "houses"
    assert values["plans"]["count"] == 5
    assert [line.partition(":")[0] for line in values["broken"]] == ["cut_off.json", "twin.json"]
    assert values["splits"]["train"]["listed"] == 4
    assert "plans left out, cannot be read, at 2 places" in said
    assert "'h0' in h0.json, too" in said
    assert "cannot be read, at 2 place" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("left_bytes", [100, 0])
def test_a_plan_that_was_damaged_after_the_build_is_named(tmp_path: Path, left_bytes: int) -> None:
    for name, width in (("a", 4.0), ("b", 6.0)):
        one_room(tmp_path / "street" / f"{name}.ply", width)
    run_build([tmp_path / "street"], tmp_path / "plans")
    (file, *_) = sorted((tmp_path / "plans" / "json").iterdir())
    file.write_bytes(file.read_bytes()[:left_bytes])
    for arguments in (("stats",), ("export", "--to", "png", "--out", tmp_path / "pictures")):
        name, *options = arguments
        said = call(name, tmp_path / "plans", *options, code=2)[1]
        assert f"plan '{file.stem}': expected one JSON object" in said


def test_where_nothing_can_be_read_it_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{")
    assert "a.json: expected one JSON object" in call("stats", tmp_path, code=2)[1]
