"""What a person says of a whole file, for the readers besides that of meshes: its size, its floors, its parts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from pipeline.batch.listing import list_inputs
from pipeline.cli_common import load_build_config
from pipeline.overrides import correct_input
from pipeline.source_record import SourceReader
from pipeline.sources import find, reader
from pipeline.values import IDLE, Level
from tests.builders.formats.ifc import tiny_house

OUTER, INNER = (0.0, 0.0, 8.0, 4.0), (0.2, 0.2, 7.8, 3.8)


def levels_of(file: Path, **said: Any) -> list[Level]:
    (item,) = find(str(file))
    return list(reader(item.reader).read(correct_input(item, {item.id: Override(**said)})))


def size_of(level: Level) -> tuple[float, float]:
    low, high = level.walls.vertices.min(axis=0), level.walls.vertices.max(axis=0)
    return round(float(high[0] - low[0]), 2), round(float(high[1] - low[1]), 2)


def record_of(file: Path, **said: Any) -> Any:
    config = load_build_config(None, {"sources": (str(file),)})
    (item,) = list_inputs(config)
    return SourceReader(config, item.id).record({item.id: Override(**said)})


def plan_dxf(file: Path, *, units: int = 6, factor: float = 1.0) -> Path:
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010", units=units)
    space = drawing.modelspace()
    for x1, y1, x2, y2 in (OUTER, INNER):
        ring = [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]
        space.add_lwpolyline([(x * factor, y * factor) for x, y in ring], close=True, dxfattribs={"layer": "WALL"})
    for x in (4.0, 4.2):
        space.add_line((x * factor, 0.2 * factor), (x * factor, 3.8 * factor), dxfattribs={"layer": "WALL_NEW"})
    drawing.saveas(file)
    return file


def map_yaml(folder: Path) -> Path:
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.05\norigin: [2.0, 3.0, 0.0]\n")
    cells = np.zeros((100, 160), np.uint8)
    cells[2:-2, 2:-2] = 254
    Image.fromarray(cells).save(folder / "map.pgm")
    return folder / "map.yaml"


def test_an_ifc_file_is_as_large_as_somebody_says(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    file = tiny_house("IFC4", 0.001).write(tmp_path / "house.ifc")
    assert size_of(levels_of(file)[0]) == (8.0, 6.0)
    assert levels_of(file)[0].unit_m == pytest.approx(0.001)
    larger = levels_of(file, scale=1.25)[0]
    assert size_of(larger) == (10.0, 7.5)
    assert "units" in larger.guesses or larger.unit_m == pytest.approx(0.00125)
    known = levels_of(file, distance=[[0, 0], [8000, 0], 10.0])[0]
    assert size_of(known) == (10.0, 7.5)
    assert "units" not in known.guesses


def test_the_floors_of_an_ifc_file_are_those_that_somebody_says(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    file = tiny_house().write(tmp_path / "house.ifc")
    assert [round(level.frame.floor, 1) for level in levels_of(file)] == [0.0, 2.8]
    assert [round(level.frame.floor, 1) for level in levels_of(file, floors=[0.0])] == [0.0]
    assert [round(level.frame.floor, 1) for level in levels_of(file, floors=[0.0, 2.8])] == [0.0, 2.8]


def test_elements_of_an_ifc_file_are_left_out_by_name_or_class(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    file = tiny_house().write(tmp_path / "house.ifc")
    assert levels_of(file)[0].leaves
    without = levels_of(file, drop_nodes=["IfcDoor"])[0]
    assert not without.leaves
    assert len(without.openings) < len(levels_of(file)[0].openings)
    names = record_of(file).names
    assert {"IfcWall", "IfcDoor"} <= set(names)


def test_a_drawing_is_in_the_unit_that_somebody_says_and_without_the_layers_that_he_names(tmp_path: Path) -> None:
    file = plan_dxf(tmp_path / "plan.dxf", units=0, factor=100.0)
    (guessed,) = levels_of(file)
    assert size_of(guessed)[0] != 12.0
    (level,) = levels_of(file, units="0.015")
    assert size_of(level) == (12.0, 6.0)
    assert "units" not in level.guesses
    assert level.unit_m == 0.015
    (level,) = levels_of(file, units="cm", scale=1.5)
    assert size_of(level) == (12.0, 6.0)
    (level,) = levels_of(file, units="cm", drop_nodes=["WALL_N*", "nothing"])
    assert any("nothing" in each for each in level.provenance[IDLE])
    assert level.walls.vertices[:, 0].max() == pytest.approx(8.0)
    inside = (level.walls.vertices[:, 0] > 1.0) & (level.walls.vertices[:, 0] < 7.0)
    assert not inside.any()


def test_a_drawing_has_its_walls_on_the_layers_that_somebody_names(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010", units=6)
    space = document.modelspace()
    for layer, ring in (("8-4", [(0, 0), (6, 0), (6, 4), (0, 4)]), ("8-9", [(0, 2), (6, 2), (6, 9), (0, 9)])):
        space.add_lwpolyline(ring, close=True, dxfattribs={"layer": layer})
    space.add_line((3, 0), (3, 3.1), dxfattribs={"layer": "8-4"})
    space.add_arc((3, 4), 0.9, 180, 270, dxfattribs={"layer": "8-5"})
    document.saveas(tmp_path / "plan.dxf")
    (level,) = levels_of(tmp_path / "plan.dxf", wall_layers=["8-4", "8-7"])
    assert size_of(level) == pytest.approx((6.0, 4.0), abs=0.2)
    assert "layers" not in level.guesses
    assert len(level.openings) == 1  # by its swing
    assert [each for each in level.provenance[IDLE] if "8-7" in each]
    assert size_of(levels_of(tmp_path / "plan.dxf")[0])[1] > 8.0  # a guess


def test_a_map_is_as_large_as_somebody_says_and_its_points_move_with_it(tmp_path: Path) -> None:
    file = map_yaml(tmp_path)
    (level,), (twice,) = levels_of(file), levels_of(file, distance=[[2.0, 3.0], [10.0, 3.0], 16.0])
    assert size_of(twice) == pytest.approx([2 * side for side in size_of(level)], abs=0.5)
    assert twice.unit_m == 2.0
    x, y = np.array(level.frame.matrix)[:, 2]
    assert np.array(twice.frame.matrix)[:, 2] == pytest.approx((2 * x, 2 * y), abs=0.6)


def test_geojson_in_another_unit_is_scaled(tmp_path: Path) -> None:
    ring = [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]
    room = {"type": "Feature", "properties": {"type": "room"}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    other = [[x + 8, y] for x, y in ring]
    rooms = [room, {**room, "geometry": {"type": "Polygon", "coordinates": [other]}}]
    crs = {"type": "name", "properties": {"name": "LOCAL_CS metre"}}
    file = tmp_path / "plan.geojson"
    file.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": rooms}))
    (level,), (half,) = levels_of(file), levels_of(file, units="0.5")
    assert [room.polygon.area for room in half.rooms] == pytest.approx([room.polygon.area / 4 for room in level.rooms])
    assert half.walls.vertices[:, 2].max() == level.walls.vertices[:, 2].max()


def test_formats_that_are_in_metres_take_no_size(tmp_path: Path) -> None:
    (item,) = find("procedural:1")
    with pytest.raises(ConfigError, match="takes no scale"):
        correct_input(item, {item.id: Override(scale=2.0)})


def test_the_page_is_told_what_can_be_said_of_each_kind_of_file(tmp_path: Path) -> None:
    record = record_of(plan_dxf(tmp_path / "plan.dxf"))
    assert record.takes == ("drop_nodes", "keep", "scale", "units", "wall_layers")
    assert {"WALL", "WALL_NEW"} <= set(record.names)
    assert {stroke.kind for stroke in record.levels[0].strokes} == {"WALL", "WALL_NEW"}
    assert record.unit_m == 1.0
    assert record_of(map_yaml(tmp_path)).takes == ("keep", "scale", "units")


def test_a_drawing_in_which_no_wall_is_found_shows_its_lines(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010", units=4)
    drawing.modelspace().add_line((0, 0), (6000, 0), dxfattribs={"layer": "DIM"})
    drawing.saveas(tmp_path / "lines.dxf")
    record = record_of(tmp_path / "lines.dxf")
    (level,) = record.levels
    assert [picture.name for picture in level.pictures] == ["lines"]
    assert level.strokes[0].points[1][0] - level.strokes[0].points[0][0] == pytest.approx(6.0)


def test_a_map_without_a_size_is_shown_in_cells_until_somebody_says_it(tmp_path: Path) -> None:
    config = load_build_config(None, {"sources": (str(map_yaml(tmp_path).with_suffix(".pgm")),)})
    (item,) = list_inputs(config)
    assert not SourceReader(config, item.id).record({}).levels
    found = SourceReader(config, item.id).record({item.id: Override(units="0.05")})
    assert found.levels[0].plans


def test_a_word_of_a_rejected_house_needs_no_second_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_build_config(None, {"sources": (str(map_yaml(tmp_path)),)})
    (item,) = list_inputs(config)
    found = SourceReader(config, item.id)
    first = found.record({})
    monkeypatch.setattr("pipeline.source_record.reader", lambda _: pytest.fail("read again"))
    assert found.record({}).levels == first.levels
