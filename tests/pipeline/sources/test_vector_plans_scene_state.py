"""Scene states of smartscenes (HSSD, SceneEval): walls with holes, floors with the names of regions, both axes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from houseexpo.floorplan import FloorPlan
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from tests.builders.round_trip import plans_of

DOOR = {"id": "d", "type": "Door", "box": {"min": [1.0, 0.0], "max": [1.9, 2.1]}}
WINDOW = {"id": "w", "type": "window", "box": {"min": [1.0, 0.8], "max": [2.0, 2.0]}}


def wall(
    room: str, a: tuple[float, float], b: tuple[float, float], *holes: dict[str, Any], z: float = 0.0
) -> dict[str, Any]:
    """A wall of a room, on the line between two rooms, as the format has it."""
    return {
        "id": f"{room}{a}{b}", "type": "Wall", "roomId": room, "points": [[*a, z], [*b, z]],
        "height": 2.8, "depth": 0.1, "holes": list(holes), "materials": [{"name": "inside"}],
    }  # fmt: skip


def around(room: str, x: float, *holes: dict[str, Any], z: float = 0.0) -> list[dict[str, Any]]:
    """A room of 4 x 3 m, whose first side (from y = 0 to 3) and third side have these holes."""
    corners = [(x, 0.0), (x, 3.0), (x + 4, 3.0), (x + 4, 0.0)]
    sides = [wall(room, one, other, z=z) for one, other in zip(corners, corners[1:] + corners[:1], strict=True)]
    sides[0]["holes"], sides[1]["holes"] = list(holes[:1]), list(holes[1:2])
    floor = {
        "id": f"{room}f",
        "type": "Floor",
        "roomId": room,
        "points": [[*each, z] for each in corners],
        "depth": 0.05,
    }
    return [*sides, floor, {"id": f"{room}c", "type": "Ceiling", "roomId": room, "points": floor["points"]}]


def arch(elements: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    regions = [{"id": "0_0", "type": "Kitchen"}, {"id": "0_1", "label": "bedroom"}]
    return {
        "version": "arch@1.0.2",
        "up": [0, 0, 1],
        "scaleToMeters": 1,
        "elements": elements,
        "regions": regions,
        **more,
    }


def scene(tmp_path: Path, found: dict[str, Any]) -> Path:
    file = tmp_path / "house.scenestate.json"
    file.write_text(json.dumps({"format": "sceneState", "scene": {"id": "1", "arch": found, "object": [{}]}}))
    return file


def plan_of(path: Path) -> FloorPlan:
    (plan,) = plans_of(path)
    return plan


def test_rooms_share_a_wall_that_each_of_them_brings(tmp_path: Path) -> None:
    plan = plan_of(scene(tmp_path, arch([*around("0_0", 0.0, {}, WINDOW), *around("0_1", 4.0, DOOR)])))
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert [round(room.area, 1) for room in plan.rooms] == [11.3, 11.3]
    (door,) = plan.doors
    assert (door.kind, door.width) == ("door", pytest.approx(0.9, abs=0.02))
    assert plan.provenance is not None
    assert plan.provenance["source"] == "scene_state"


def test_the_arch_alone_with_y_up_and_in_centimetres(tmp_path: Path) -> None:
    elements = [*around("0_0", 0.0), *around("0_1", 4.0, DOOR)]
    for element in elements:
        element["points"] = [[100 * x, 100 * z, -100 * y] for x, y, z in element["points"]]
        element |= {key: 100 * element[key] for key in ("height", "depth") if key in element}
        for hole in element.get("holes", []):
            if hole:
                hole["box"] = {key: [100 * each for each in hole["box"][key]] for key in ("min", "max")}
    found = arch(json.loads(json.dumps(elements)), up=[0, 1, 0], scaleToMeters=0.01)
    (tmp_path / "arch.json").write_text(json.dumps(found))
    plan = plan_of(tmp_path / "arch.json")
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["door"]
    assert plan.frame is not None
    assert plan.frame.up == "y"


def test_storeys_by_their_floors(tmp_path: Path) -> None:
    two = scene(tmp_path, arch([*around("0_0", 0.0), *around("0_1", 0.0, z=3.0)]))
    plans = plans_of(two)
    assert [plan.rooms[0].label for plan in plans] == ["Kitchen", "Bedroom"]
    assert [plan.frame.level for plan in plans if plan.frame] == [0, 1]


def test_what_cannot_be_read_costs_only_itself(tmp_path: Path) -> None:
    bad = [
        {"type": "Wall", "points": [[0, 0, float("nan")], [1, 0, 0]], "height": 2},
        {"type": "Wall", "points": [[0, 0, 0], [1, 0, 0]], "height": "high"},
        {"type": "Floor", "points": [[0, 0, 0], [1, 0, 0]]},
        {"type": "Wall"}, "wall", None,
    ]  # fmt: skip
    holes = [{}, {"type": "Door", "box": None}, {"type": "Door", "box": {"min": [2, 0], "max": [1, 2]}}]
    house = around("0_0", 0.0)
    house[0]["holes"] = holes
    plan = plan_of(scene(tmp_path, arch([*house, *bad])))
    assert len(plan.rooms) == 1
    assert plan.provenance is not None
    assert "element 6" in plan.provenance["left_out"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"format": "sceneState", "scene": {}}', "expected scene.arch.elements"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": 3}}}', "TypeError"),
        ('{"format": "sceneState", ', "expected scene.arch.elements"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": []}}}', "found 0 elements"),
        ('{"format": "sceneState", "scene": {"arch": {"elements": [], "scaleToMeters": -1}}}', "a metre is -1.0"),
        ('{"format": "sceneState", "scene": ' + "[" * 60000, "expected scene.arch.elements"),
    ],
)
def test_what_is_no_scene_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "bad.json").write_text(text)
    (item,) = find(str(tmp_path / "bad.json"))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert said in caught.value.detail
