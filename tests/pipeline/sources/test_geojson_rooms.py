"""Read GeoJSON whose areas are called by the function of a room, and whose unit is stated nowhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from tests.builders.batch import plans_of

Corners = tuple[float, float, float, float]


def area(corners: Corners, scale: float = 1.0, **about: Any) -> dict[str, Any]:
    x1, y1, x2, y2 = (value * scale for value in corners)
    ring = [[x1, y1], [x2, y1], [x2, y2], [x1, y2], [x1, y1]]
    return {"type": "Feature", "properties": about, "geometry": {"type": "Polygon", "coordinates": [ring]}}


def written(path: Path, *features: dict[str, Any]) -> Path:
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_areas_called_by_their_function_are_rooms(tmp_path):
    path = written(
        tmp_path / "floor.geojson",
        area((0, 0, 6, 4), type="classroom", name="12"),
        area((6.1, 0, 12, 4), type="admin_office"),
        area((0, 4.1, 12, 6), type="corridor"),
        area((12.1, 0, 15, 6), type="aula"),
        {"type": "Feature", "properties": {"type": "elevator"}, "geometry": {"type": "Point", "coordinates": [1, 5]}},
    )
    (plan,) = plans_of(path)
    assert sorted(room.label for room in plan.rooms) == ["Hallway", "Office", "Room", "Unlabelled"]
    assert "12" in {word for room in plan.rooms for word in room.source_labels}


def test_storeys_are_told_by_their_floor_ids(tmp_path):
    path = written(
        tmp_path / "floor.geojson",
        *(area((0, 0, 6, 4), category="retail", floorId=floor) for floor in ("a", "b")),
    )
    assert [plan.frame.level for plan in plans_of(path)] == [0, 1]


@pytest.mark.parametrize(
    "features",
    [
        [area((0, 0, 6, 4), type="residential"), area((7, 0, 9, 4), type="park"), area((9, 0, 12, 4), type="office")],
        [area((0, 0, 6, 4), name="Nepal")],
    ],
)
def test_areas_of_which_most_are_no_rooms_are_left_out(tmp_path, features):
    path = written(tmp_path / "land.geojson", *features)
    try:
        (plan,) = plans_of(path)
    except (Rejection, ValueError):
        return
    assert [room.label for room in plan.rooms] == ["Office"]


def test_a_file_with_walls_has_furniture_by_such_words(tmp_path):
    walls = [area(corners, kind="wall") for corners in ((0, 0, 6, 0.1), (0, 3.9, 6, 4), (0, 0, 0.1, 4), (5.9, 0, 6, 4))]
    path = written(tmp_path / "plan.geojson", *walls, area((2, 2, 3, 3), kind="storage"))
    (plan,) = plans_of(path)
    assert plan.area == pytest.approx(5.8 * 3.8, rel=0.02)


@pytest.mark.parametrize("scale", [1.0, 100.0, 1000.0])
def test_coordinates_larger_than_any_site_are_in_a_smaller_unit(tmp_path, scale):
    rooms = [area((7.0 * k, 0.0, 7.0 * k + 6.8, 5.0), scale, type="classroom") for k in range(6)]
    (item,) = find(str(written(tmp_path / "floor.geojson", *rooms)))
    (level,) = reader(item.reader).read(item)
    assert [room.polygon.area for room in level.rooms] == pytest.approx([34.0] * 6)
    assert level.guesses == (("units",) if scale > 1.0 else ())


def test_a_map_of_countries_says_what_is_missing(tmp_path):
    path = written(tmp_path / "world.geojson", area((80, 26, 88, 30), DISTRICT="Kaski"))
    (item,) = find(str(path))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason is Reason.NO_LEVEL
    assert "found none of 1" in caught.value.detail


def test_features_whose_only_property_is_a_name_are_what_it_says(tmp_path):
    path = written(tmp_path / "flat.geojson", area((0, 0, 4, 3), name="Kitchen"), area((4.1, 0, 8, 3), name="Bedroom"))
    (plan,) = plans_of(path)
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
