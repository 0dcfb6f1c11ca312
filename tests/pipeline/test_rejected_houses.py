"""A rejected house becomes a plan by what a person says of it, by command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import trimesh
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset
from houseexpo.files import sha256_of
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from tests.builders.batch import lines
from tests.builders.meshes import box

WALLS = "wall = [[[7.9, 0.3], [7.9, 5.7]], [[0.3, 5.9], [7.7, 5.9]]]"
ROOM = "room_outline = [[0.2, 0.2], [7.8, 0.2], [7.8, 5.8], [0.2, 5.8]]"


def two_walls(path: Path) -> Path:
    """Two of the four walls of a house of 8 x 6 m, without a floor."""
    trimesh.util.concatenate([box((0, 0, 8, 0.2), 0, 2.5), box((0, 0.2, 0.2, 6), 0, 2.5)]).export(path)
    return path


def slab(path: Path) -> Path:
    """A floor without a wall."""
    box((0, 0, 8, 6), -0.2, 0.0).export(path)
    return path


def build(source: Path, out: Path, corrections: str = "") -> tuple[list[dict[str, Any]], list[FloorPlan], str]:
    """What the command rejected, the plans, and what it printed; corrections are of the house that was rejected."""
    words = ["build", str(source), "--out", str(out), "--workers", "1", "--units", "m", "--up", "z"]
    if corrections:
        (first,) = build(source, out.with_name("rejected"))[0]
        (out.with_name("mine.toml")).write_text(f"[{first['id']}]\n{corrections}\n")
        words += ["--overrides", str(out.with_name("mine.toml"))]
    done = CliRunner().invoke(make_app(), words)
    rejected = lines(out / "rejected.jsonl") if (out / "rejected.jsonl").exists() else []
    return rejected, list(open_dataset(out)) if not rejected else [], " ".join(done.output.split())


@pytest.mark.parametrize(
    ("corrections", "rooms", "doors"),
    [
        (WALLS, [43.2], []),
        (ROOM, [42.6], []),
        (f"{WALLS}\nroom = [4, 3]\nentrance = [[7.9, 1.0], [7.9, 2.0]]", [43.2], ["entrance"]),
        (f"{WALLS[:-1]}, [[4, 0.1], [4, 5.9]]]\ndoor = [[4, 1], [4, 2]]", [21.2, 21.5], ["door"]),
        (f'{ROOM}\nlabel = [1, 1, "Kitchen"]\nentrance = [[7.9, 1.0], [7.9, 2.0]]', [42.6], ["entrance"]),
    ],
)
def test_a_house_without_a_closed_room_becomes_a_plan_by_its_walls_or_its_rooms(
    tmp_path: Path, corrections: str, rooms: list[float], doors: list[str]
) -> None:
    rejected, (plan,), output = build(two_walls(tmp_path / "ruin.ply"), tmp_path / "out", corrections)
    assert not rejected
    assert sorted(round(room.area, 1) for room in plan.rooms) == pytest.approx(rooms, abs=0.5)
    assert [door.kind for door in plan.doors] == doors
    assert all(door.confidence == 1.0 for door in plan.doors)
    told = (plan.provenance or {})["corrections"]
    assert "without it the house was rejected (not_enclosed)" in told[0]["said"]
    assert {each["outcome"] for each in told} <= {"done", "already"}
    assert "correction without effect" not in output
    assert plan.quality is not None
    assert plan.navigability
    corners = source_points_from_plan(plan.frame, [plan.bbox[:2], plan.bbox[2:]])
    assert corners.round(1).ravel().tolist() == pytest.approx([0.2, 0.2, 7.8, 5.8], abs=0.25)


def test_walls_that_enclose_nothing_leave_it_rejected_and_say_so(tmp_path: Path) -> None:
    rejected, _, output = build(two_walls(tmp_path / "ruin.ply"), tmp_path / "out", "wall = [[3, 0.1], [4, 0.1]]")
    assert [each["reason"] for each in rejected] == ["not_enclosed"]
    assert "what overrides.toml says of walls and rooms encloses none" in rejected[0]["detail"]
    assert "correction without effect" in output


def test_a_file_in_which_no_wall_stands_has_the_room_that_a_person_draws(tmp_path: Path) -> None:
    (first,) = build(slab(tmp_path / "floor.ply"), tmp_path / "before")[0]
    assert first["reason"] in {"no_level", "no_interior", "bad_units"}
    _, (plan,), _ = build(slab(tmp_path / "floor.ply"), tmp_path / "out", ROOM)
    assert [round(room.area, 1) for room in plan.rooms] == [42.6]
    assert (plan.provenance or {})["source"] == "mesh_file"


def test_a_rejected_file_can_be_no_house(tmp_path: Path) -> None:
    rejected, _, _ = build(slab(tmp_path / "floor.ply"), tmp_path / "out", 'drop = true\nwhy = "a stage"')
    assert [(each["reason"], each["detail"]) for each in rejected] == [("dropped_by_hand", "a stage")]


def test_a_facade_that_a_person_keeps_is_read(tmp_path: Path) -> None:
    shell = trimesh.creation.box(bounds=[[0, 0, 0], [9, 7, 2.7]])
    shell.export(tmp_path / "shell.ply")
    assert [each["reason"] for each in build(tmp_path / "shell.ply", tmp_path / "before")[0]] == ["no_interior"]
    corners = "room_outline = [[0, 0], [9, 0], [9, 7], [0, 7]]"
    _, (plan,), output = build(tmp_path / "shell.ply", tmp_path / "out", f"keep = true\n{corners}")
    assert [round(room.area) for room in plan.rooms] == [63]
    assert (plan.provenance or {})["kept_from"] == "no_interior"
    assert "correction without effect" not in output


@pytest.mark.slow
@pytest.mark.parametrize("make", [two_walls, slab])
def test_what_is_said_of_one_of_two_rejected_houses_of_equal_names_is_of_this_one(
    tmp_path: Path, make: Callable[[Path], Path]
) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    make(folder / "ruin.ply")
    box((0, 0, 3, 2), -0.2, 0.0).export(folder / "ruin.obj")
    rejected, _, _ = build(folder, tmp_path / "before")
    names = [each["id"] for each in rejected]
    own = sha256_of(folder / "ruin.ply")[:8]
    assert [name for name in names if name.endswith(own)] == [f"ruin_{own}"]
    (tmp_path / "mine.toml").write_text(f"[ruin_{own}]\n{ROOM}\n")
    words = ["build", str(folder), "--out", str(tmp_path / "out"), "--workers", "1", "--units", "m", "--up", "z"]
    CliRunner().invoke(make_app(), [*words, "--overrides", str(tmp_path / "mine.toml")])
    (plan,) = open_dataset(tmp_path / "out")
    assert [round(room.area, 1) for room in plan.rooms] == [42.6]
    (left,) = lines(tmp_path / "out" / "rejected.jsonl")
    assert left["id"].startswith("ruin_")
