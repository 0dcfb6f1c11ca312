"""Open-RMF buildings: scale, walls, doors, lifts and names, and what is refused."""

import copy

import pytest
import shapely
import yaml

from houseexpo.exports import rmf
from houseexpo.plan.categories import UNLABELLED
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from tests.builders.round_trip import plans_of

SCALE = 0.05
CORNERS = [(0, 0), (120, 0), (120, 80), (0, 80), (60, 0), (60, 30), (60, 48), (60, 80)]
DOOR = {"name": [1, "d"], "type": [1, "hinged"]}
TWO_ROOMS = {
    "coordinate_system": "reference_image",
    "levels": {
        "L1": {
            "elevation": 0.0,
            "vertices": [*([x, y, 0, ""] for x, y in CORNERS), [30, 40, 0, "kitchen"], [90, 40, 0, "spot_7"]],
            "measurements": [[0, 1, {"distance": [3, 120 * SCALE]}]],
            "walls": [[0, 1, {}], [1, 2, {}], [2, 3, {}], [3, 0, {}], [4, 5, {}], [6, 7, {}]],
            "doors": [[5, 6, DOOR]],
        }
    },
    "lifts": {},
    "name": "two rooms",
}


def built(tmp_path, building, name="two.building.yaml"):
    (tmp_path / name).write_text(yaml.safe_dump(building))
    return plans_of(tmp_path / name)


def changed(**level):
    building = copy.deepcopy(TWO_ROOMS)
    building["levels"]["L1"].update(copy.deepcopy(level))
    return building


def test_two_rooms_with_a_door(tmp_path):
    (plan,) = built(tmp_path, TWO_ROOMS)
    assert sorted(room.label for room in plan.rooms) == ["Kitchen", UNLABELLED]
    (door,) = plan.doors
    assert (door.kind, round(door.width, 2)) == ("door", 0.9)
    assert plan.area == pytest.approx(2 * 2.9 * 3.9 + 0.9 * 0.1, abs=0.02)  # walls are 0.1 m thick
    assert plan.provenance["source"] == "open-rmf"
    kitchen = next(room for room in plan.rooms if room.label == "Kitchen")
    assert kitchen.polygon.centroid.x < plan.bbox[2] / 2


def test_a_picture_runs_down_and_metres_run_up(tmp_path):
    building = changed(vertices=[*TWO_ROOMS["levels"]["L1"]["vertices"][:8], [30, 10, 0, "bedroom"], [0, 0, 0, ""]])
    building["levels"]["L1"]["walls"].append([9, 8, {}])  # a wall that stands in the upper left corner
    down = built(tmp_path, building)[0]
    building["coordinate_system"] = "cartesian_meters"
    for vertex in building["levels"]["L1"]["vertices"]:
        vertex[0], vertex[1] = vertex[0] * SCALE, -vertex[1] * SCALE
    up = built(tmp_path, building, "metres.building.yaml")[0]
    assert shapely.equals_exact(shapely.normalize(down.free_space), shapely.normalize(up.free_space), 0.011)


def test_a_lift_is_a_room_with_a_door(tmp_path):
    building = changed()
    vertices = building["levels"]["L1"]["vertices"]
    vertices += [[120, 20, 0, ""], [160, 20, 0, ""], [160, 60, 0, ""], [120, 60, 0, ""]]
    building["levels"]["L1"]["walls"] = [*building["levels"]["L1"]["walls"], [10, 11, {}], [11, 12, {}], [12, 13, {}]]
    cabin = {"x": 140, "y": 40, "yaw": 0.0, "width": 1.7, "depth": 1.7, "level_doors": {"L1": ["front"]}}
    door = {"x": -1.0, "y": 0.0, "width": 0.9, "motion_axis_orientation": 1.5708, "door_type": 2}
    building["lifts"] = {"one": {**cabin, "doors": {"front": door}}}
    (plan,) = built(tmp_path, building)
    assert "Passenger_elevator" in {room.label for room in plan.rooms}
    assert len(plan.doors) == 2


def test_a_level_without_a_measurement_takes_the_scale_of_the_other(tmp_path):
    building = changed()
    upper = copy.deepcopy(building["levels"]["L1"])
    upper["measurements"], upper["elevation"] = [], 3.0
    building["levels"]["L2"] = upper
    low, high = built(tmp_path, building)
    assert low.area == pytest.approx(high.area)
    assert high.frame.floor == 3.0
    assert "no measurement" in high.provenance["left_out"]


def test_what_names_a_vertex_that_is_not_there_is_left_out(tmp_path):
    level = TWO_ROOMS["levels"]["L1"]
    (plan,) = built(tmp_path, changed(walls=[*level["walls"], [0, 99, {}]], doors=[*level["doors"], ["a", None, {}]]))
    assert len(plan.rooms) == 2
    assert "walls[6]" in plan.provenance["left_out"]
    assert "doors[1]" in plan.provenance["left_out"]


@pytest.mark.parametrize(
    ("change", "reason", "said"),
    [
        ({"walls": []}, Reason.NO_LEVEL, "traffic map of lanes"),
        ({"measurements": []}, Reason.BAD_UNITS, "measurement"),
        ({"vertices": "none"}, Reason.BAD_UNITS, "measurement"),
    ],
)
def test_what_is_no_plan_is_refused_with_the_reason(tmp_path, change, reason, said):
    with pytest.raises(Rejection, match=said) as caught:
        built(tmp_path, changed(**change))
    assert caught.value.reason is reason


@pytest.mark.parametrize(
    "text",
    [
        "levels: &a [*a]\n",
        "a: &a [x, x]\nb: &b [*a, *a]\nlevels:\n  L1: {vertices: *b}\n",
        "levels: [1, 2\n",
        "levels:\n  !!python/object/apply:os.system ['touch /tmp/never']\n",
        "- 1\n",
        "levels: " + "[" * 50_000,
    ],
)
def test_yaml_that_is_no_building_is_rejected(tmp_path, text):
    path = tmp_path / "bad.building.yaml"
    path.write_text(text)
    (item,) = find(str(path))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason in {Reason.UNREADABLE, Reason.NO_LEVEL}


def test_the_export_is_as_traffic_editor_writes_it(tmp_path):
    (plan,) = built(tmp_path, TWO_ROOMS)
    files = rmf(plan)
    assert set(files) == {f"{plan.id}.building.yaml", f"{plan.id}.png"}
    building = yaml.safe_load(files[f"{plan.id}.building.yaml"])
    level = building["levels"]["L1"]
    assert level["drawing"]["filename"] in files
    assert {vertex[3] for vertex in level["vertices"]} == {"", "Kitchen"}
    for kind in ("walls", "doors", "measurements"):
        for start, end, parameters in level[kind]:
            assert {start, end} <= set(range(len(level["vertices"])))
            assert all(isinstance(value, list) and len(value) == 2 for value in parameters.values())
    assert len(level["floors"]) == 3
    assert b"*id" not in files[f"{plan.id}.building.yaml"]
