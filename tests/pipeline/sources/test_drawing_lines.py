"""The lines that a person sees of a drawing lie where the level has its walls, whatever the file's axes and unit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.grids.frame import plan_points_from_source
from pipeline.sources import find, reader
from pipeline.sources.vector_plans import drawing_lines
from pipeline.values import Input, Level
from tests.builders.formats import published_plans as published
from tests.pipeline.sources.test_vector_plans import written
from tests.pipeline.sources.test_vector_plans_scenes import DOOR, arch, around, collection, scene


def levels_and_lines(item: Input) -> list[tuple[Level, list[tuple[str, Any]]]]:
    """The levels of a file, and the names and points, in the level frame, of the lines of each."""
    storeys, names = drawing_lines(item)
    assert names == []
    levels = [each for each in reader(item.reader).read(item) if isinstance(each, Level)]
    assert len(storeys) == len(levels)
    return [
        (level, [(name, plan_points_from_source(level.frame, points * level.unit_m)) for name, points in lines])
        for level, lines in zip(levels, storeys, strict=True)
    ]


def lie_at_the_walls(level: Level, lines: list[tuple[str, Any]]) -> bool:
    """Whether the lines of walls and rooms reach as far as the walls do, up to a wall's thickness."""
    points = np.concatenate([points for name, points in lines if name in {"wall", "room", "space"}])
    walls = level.walls.vertices[:, :2]
    return bool(
        np.allclose(points.min(axis=0), walls.min(axis=0), atol=0.35)
        and np.allclose(points.max(axis=0), walls.max(axis=0), atol=0.35)
    )


def test_a_drawing_shows_its_lines_where_the_level_has_its_walls(tmp_path: Path) -> None:
    (item,) = find(str(written(tmp_path / "model.svg", published.cubicasa())))
    ((level, lines),) = levels_and_lines(item)
    assert lie_at_the_walls(level, lines)
    assert "door" in {name for name, _ in lines}
    (larger, moved) = levels_and_lines(replace(item, options=(*item.options, ("scale", "2.0"))))[0]
    assert lie_at_the_walls(larger, moved)
    assert not lie_at_the_walls(larger, lines)


def test_storeys_have_their_own_lines_and_y_may_be_up(tmp_path: Path) -> None:
    two = scene(tmp_path, arch([*around("0_0", 0.0), *around("0_1", 6.0, z=3.0)]))
    (item,) = find(str(two))
    found = levels_and_lines(item)
    assert len(found) == 2
    assert all(lie_at_the_walls(level, lines) for level, lines in found)
    assert not lie_at_the_walls(found[0][0], found[1][1])
    elements = json.loads(json.dumps([*around("0_0", 2.0), *around("0_1", 6.0, DOOR)]))
    for element in elements:
        element["points"] = [[x, z, -y] for x, y, z in element["points"]]
    (tmp_path / "arch.json").write_text(json.dumps(arch(elements, up=[0, 1, 0])))
    (item,) = find(str(tmp_path / "arch.json"))
    ((level, lines),) = levels_and_lines(item)
    assert level.frame.up == "y"
    assert lie_at_the_walls(level, lines)


@pytest.mark.parametrize("unit", [1.0, 1e-5])
def test_geojson_shows_what_its_reader_passes_over(tmp_path: Path, unit: float) -> None:
    found = collection(lambda x, y: (unit * x, unit * y))
    (tmp_path / "rooms.geojson").write_text(json.dumps(found))
    before = levels_and_lines(next(iter(find(str(tmp_path / "rooms.geojson")))))[0]
    line = {"type": "LineString", "coordinates": [[unit * x, unit * 2.0] for x in (4.2, 8.2)]}
    found["features"].append({"type": "Feature", "properties": {"category": "folding screen"}, "geometry": line})
    (tmp_path / "rooms.geojson").write_text(json.dumps(found))
    level, lines = levels_and_lines(next(iter(find(str(tmp_path / "rooms.geojson")))))[0]
    assert np.array_equal(level.walls.vertices, before[0].walls.vertices)
    assert lie_at_the_walls(level, lines)
    (screen,) = [points for name, points in lines if name == "folding screen"]
    assert np.ptp(screen, axis=0).tolist() == pytest.approx([4.0 if unit == 1.0 else 4.45, 0.0], abs=0.01)
    assert len(lines) == len(before[1]) + 1


def test_a_file_that_cannot_be_read_shows_none(tmp_path: Path) -> None:
    item = next(iter(find(str(written(tmp_path / "model.svg", published.cubicasa())))))
    (tmp_path / "model.svg").write_text('<svg><g class="Wall"><polygon points="0,0 1,0 1,1"/></g></svg>')
    assert drawing_lines(item) == ([], [])


def test_a_damaged_geojson_file_shows_none(tmp_path: Path) -> None:
    (tmp_path / "rooms.geojson").write_text(json.dumps(collection()))
    (item,) = find(str(tmp_path / "rooms.geojson"))
    (tmp_path / "rooms.geojson").write_text('{"type": "FeatureCollection", "features": [')
    assert drawing_lines(item) == ([], [])
    (tmp_path / "rooms.geojson").write_text('{"type": "FeatureCollection", "features": [1, {}, {"geometry": {}}]}')
    assert drawing_lines(item) == ([], [])
