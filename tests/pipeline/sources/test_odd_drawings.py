"""Parts of drawings that are odd, but said: none of them costs another part, and none becomes another thing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from shapely import MultiPolygon, box

from pipeline.sources.vector_plans import dxf, geojson, scene_state
from pipeline.sources.vector_plans.drawing import DrawnStorey, Feature
from pipeline.sources.vector_plans.named_features import storey_from_features


def written(path: Path, content: Any) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def areas(storey: DrawnStorey) -> list[float]:
    return [round(wall.shape.area, 2) for wall in storey.walls]


@pytest.mark.parametrize(("unit_m", "code"), [(0.001, 4), (1.0, 6)])
def test_rings_of_a_hatch_that_touch_by_a_hair_are_holes_in_any_unit(tmp_path: Path, unit_m: float, code: int) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = code
    document.layers.add("WALLS")
    hatch = document.modelspace().add_hatch(dxfattribs={"layer": "WALLS"})
    for x1, y1, x2, y2 in ((0, 0, 8, 6), (-0.00005, 0.2, 7.8, 5.8)):
        ring = [(x / unit_m, y / unit_m) for x, y in ((x1, y1), (x2, y1), (x2, y2), (x1, y2))]
        hatch.paths.add_polyline_path(ring, is_closed=True)
    document.saveas(tmp_path / "plan.dxf")
    assert areas(dxf.read_drawing(tmp_path / "plan.dxf").storeys[0]) == [4.32]


@pytest.mark.parametrize("defaults", [None, [], {"Wall": None}])
def test_defaults_of_no_use_and_a_damaged_hole_cost_no_wall(tmp_path: Path, defaults: Any) -> None:
    wall = {"type": "Wall", "points": [[0, 0, 0], [4, 0, 0]], "height": 2.5, "depth": 0.1}
    wall["holes"] = [{"type": "Door", "box": {"min": [1], "max": [2]}}]
    elements = [wall, {"type": "Floor", "points": [[0, 0, 0], [4, 0, 0], [4, 4, 0]]}]
    scene = {"format": "sceneState", "scene": {"arch": {"defaults": defaults, "elements": elements}}}
    (storey,) = scene_state.read_drawing(written(tmp_path / "state.json", scene)).storeys
    assert (len(storey.walls), len(storey.rooms)) == (1, 1)


def test_a_door_whose_line_goes_all_round_it_is_one_door(tmp_path: Path) -> None:
    def feature(kind: str, shape: str, points: Any) -> dict[str, Any]:
        return {"type": "Feature", "properties": {"kind": kind}, "geometry": {"type": shape, "coordinates": points}}

    features = [
        feature("room", "Polygon", [[[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]]),
        feature("room", "Polygon", [[[4.1, 0], [8, 0], [8, 4], [4.1, 4], [4.1, 0]]]),
        feature("door", "LineString", [[4, 1], [4.1, 1], [4.1, 2], [4, 2], [4, 1]]),
    ]
    found = {"type": "FeatureCollection", "crs": "metre", "features": features}
    (storey,) = geojson.read_drawing(written(tmp_path / "flat.geojson", found)).storeys
    assert [hole.shape.bounds for hole in storey.holes] == [(4.0, 1.0, 4.1, 2.0)]


def test_a_piece_of_furniture_of_two_parts_is_one_piece() -> None:
    chair = MultiPolygon([box(1, 1, 1.1, 1.1), box(1.4, 1, 1.5, 1.1)])
    storey = storey_from_features(
        [Feature("wall", box(0, 0, 4, 0.1), filled=True), Feature("object", chair, ("chair",))]
    )
    assert [piece.words for piece in storey.furniture] == [("chair",)]
