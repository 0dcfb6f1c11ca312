"""What a person is shown of a source: pictures to scale, walls to snap to, places for doors, the plan without words."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
import pytest
import shapely
import trimesh
from PIL import Image

from houseexpo import build, open_dataset
from houseexpo.corrections import Correction, Override
from houseexpo.corrections.apply import correct_plan
from houseexpo.corrections.preview import preview
from houseexpo.dataset.source_records import SourceRecord, decode_source_record, encode_source_record
from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan.json_codec import encode
from houseexpo.service.review.sources import SourceView, _view
from pipeline.algorithm import plan_largest_building
from pipeline.batch.job import level_rng
from pipeline.batch.listing import list_inputs
from pipeline.cli_common import load_build_config
from pipeline.source_record import SECTIONS_M, SourceReader, _places
from pipeline.sources import reader
from pipeline.values import Level
from tests.builders.bungalow import FILE
from tests.builders.examples import FOLDER
from tests.builders.formats.clouds import flat, sampled, write_pcd
from tests.builders.formats.gazebo import cube, house, world
from tests.builders.services import two_rooms
from tests.pipeline.sources.test_vector_plans_scenes import collection


def config_of(path: Path) -> Any:
    return load_build_config(None, {"sources": (str(path),)})


def id_of(path: Path) -> str:
    return next(iter(list_inputs(config_of(path)))).id


def test_a_record_is_the_same_after_it_was_written() -> None:
    record = SourceReader(config_of(FILE), id_of(FILE)).record({})
    assert decode_source_record(encode_source_record(record)) == record
    assert record.side is not None
    assert record.side.bounds[1] < 0.0  # heights: the floor, and the ceiling
    assert record.side.bounds[3] > 2.6
    assert (record.is_odd, record.other_floors) == (False, ())
    assert record.levels[0].ceiling_m == pytest.approx(2.6, abs=0.1)


def test_a_place_is_as_wide_as_its_lintel_and_the_rim_of_a_roof_is_none() -> None:
    """A rim around a house, and a beam from it, cross the lintel of a door 1.6 m wide."""
    rim = shapely.difference(shapely.box(-0.4, -0.4, 8.4, 6.4), shapely.box(-0.3, -0.3, 8.3, 6.3))
    door, beam = shapely.box(2.0, 0.0, 3.6, 0.1), shapely.box(3.0, -0.3, 3.1, 0.1)
    whole = shapely.union_all([rim, door, beam])
    parts = [SimpleNamespace(closed_by="lintel", polygon=shapely.box(*x)) for x in ((2, 0, 3, 0.1), (3.1, 0, 3.6, 0.1))]
    evidence: Any = SimpleNamespace(doorways=[], lintels=whole)
    layout: Any = SimpleNamespace(candidates=parts, ways=[])
    (place,) = _places(evidence, layout, is_map=False)
    assert sorted(np.abs(np.array(place.ends)).round(2).tolist()) == [[2.0, 0.05], [3.6, 0.05]]


def test_the_plan_and_its_spaces_are_enough_to_say_what_a_build_will_do() -> None:
    config, name = config_of(FILE), id_of(FILE)
    (item,) = list_inputs(config)
    record = SourceReader(config, name).record({})
    (level,) = record.levels
    (found,) = level.plans
    view = SourceView(record, level, found)
    plan = decode(bytes(found.plan))
    (x, y), frame = plan.rooms[0].polygon.representative_point().coords[0], plan.frame
    assert frame is not None
    (a, b, c), (d, e, f) = frame.matrix
    place = (round(a * x + b * y + c, 3), round(d * x + e * y + f, 3))
    said = [Correction("no_room", place)]
    (there,) = (each for each in reader(item.reader).read(item) if isinstance(each, Level))
    built = plan_largest_building(replace(there, corrections=tuple(said)), config.planning, level_rng(there, 0))
    told = preview(plan, said, plan, view.spaces)
    assert [room.area for room in told.plan.rooms] == pytest.approx([room.area for room in built.rooms])
    assert len(told.plan.doors) == len(built.doors)
    assert told.records[0]["said"] == (built.provenance or {})["corrections"][0]["said"]


def test_what_a_plan_was_built_with_is_gone_when_it_is_taken_out() -> None:
    config = config_of(FILE)
    (item,) = list_inputs(config)
    record = SourceReader(config, item.id).record({})
    (found,) = record.levels[0].plans
    base = decode(bytes(found.plan))
    (there,) = (each for each in reader(item.reader).read(item) if isinstance(each, Level))
    (x, y), frame = base.rooms[0].polygon.representative_point().coords[0], base.frame
    assert frame is not None
    (a, b, c), (d, e, f) = frame.matrix
    words = (Correction("no_room", (a * x + b * y + c, d * x + e * y + f)),)
    built = plan_largest_building(replace(there, corrections=words), config.planning, level_rng(there, 0))
    assert len(built.rooms) < len(base.rooms)
    assert len(preview(built, [], base, ()).plan.rooms) == len(base.rooms)
    assert len(preview(built, []).plan.rooms) == len(built.rooms)  # nobody knows better without the source


def test_sections_show_what_stands_at_their_height_to_scale(tmp_path: Path) -> None:
    parts = [
        trimesh.creation.box(bounds=[[0, 0, 0], [6, 0.2, 2.6]]),
        trimesh.creation.box(bounds=[[0, 4, 0], [6, 4.2, 2.6]]),
        trimesh.creation.box(bounds=[[0, 0, 0], [0.2, 4.2, 2.6]]),
        trimesh.creation.box(bounds=[[5.8, 0, 0], [6, 4.2, 2.6]]),
        trimesh.creation.box(bounds=[[0, 0, -0.1], [6, 4.2, 0]]),
        trimesh.creation.box(bounds=[[2, 2, 0], [3, 3, 1.4]]),  # a cupboard: at 1.1 m, and not at 1.9 m
    ]  # fmt: skip
    file = tmp_path / "box.ply"
    trimesh.util.concatenate(parts).export(file)
    record = SourceReader(config_of(file), id_of(file)).record({})
    (level,) = record.levels
    pictures = {picture.name: picture for picture in level.pictures}
    assert {"top", "section_1_1", "section_1_9"} <= set(pictures)
    (_, _, shift_x), (_, _, shift_y) = level.frame.matrix
    for name, cupboard in (("section_1_1", True), ("section_1_9", False)):
        picture = pictures[name]
        image = np.asarray(Image.open(io.BytesIO(picture.png)))[..., 3] > 0
        x1, y1, x2, y2 = picture.bounds

        def drawn(x: float, y: float, image: Any = image, box: Any = (x1, y1, x2, y2)) -> bool:
            a, b, c, d = box
            col = round((x - shift_x - a) / (c - a) * image.shape[1])
            row = round((d - (y - shift_y)) / (d - b) * image.shape[0])
            return bool(image[max(row - 3, 0) : row + 4, max(col - 3, 0) : col + 4].any())

        assert drawn(3.0, 0.0)
        assert drawn(0.0, 2.0)
        assert not drawn(4.5, 2.0)
        assert drawn(2.0, 2.5) is cupboard
    assert SECTIONS_M == (1.1, 1.9)
    solid = level.solid
    assert solid is not None
    corners = np.frombuffer(solid.corners, "<f4").reshape(-1, 3)
    faces = np.frombuffer(solid.faces, "<u4").reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx([-shift_x, -shift_y, -0.1], abs=1e-3)
    assert corners.max(axis=0) == pytest.approx([6 - shift_x, 4.2 - shift_y, 2.6], abs=1e-3)
    assert len(faces) == 12 * len(parts)


def test_of_a_large_mesh_the_largest_triangles_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = areas_of(SourceReader(config_of(FILE), id_of(FILE)).record({}))
    monkeypatch.setattr("pipeline.source_record._MOST_TRIANGLES", 100)
    fewer = areas_of(SourceReader(config_of(FILE), id_of(FILE)).record({}))
    assert len(whole) > 100
    assert np.sort(fewer) == pytest.approx(np.sort(whole)[-100:], rel=1e-5)


def areas_of(record: SourceRecord) -> npt.NDArray[np.float64]:
    """The areas of the triangles that a record shows, square metres."""
    solid = record.levels[0].solid
    assert solid is not None
    corners = np.frombuffer(solid.corners, "<f4").reshape(-1, 3).astype(np.float64)
    found: npt.NDArray[np.float64] = trimesh.triangles.area(corners[np.frombuffer(solid.faces, "<u4").reshape(-1, 3)])
    return found


def test_what_stands_higher_than_a_person_is_a_line_in_its_middle(tmp_path: Path) -> None:
    bounds = [
        *([[x, 0, 0], [x + 0.2, 5, 2.6]] for x in (0, 6)),
        *([[0.2, y, 0], [6, y + 0.2, 2.6]] for y in (0, 4.8)),
        [[3, 0.2, 0], [3.1, 2.2, 2.6]],  # a wall that ends in the room
        [[1, 3, 0], [2, 4, 1.2]],  # a cupboard
        [[0, 0, -0.1], [6.2, 5, 0]],
    ]
    file = tmp_path / "house.ply"
    trimesh.util.concatenate([trimesh.creation.box(bounds=each) for each in bounds]).export(file)
    (level,) = SourceReader(config_of(file), id_of(file)).record({}).levels
    found = [np.sort(np.round(line, 2), axis=0).tolist() for line in level.seen]
    assert [[3.05, 0.2], [3.05, 2.2]] in found
    assert not [line for line in found if 1 <= line[0][0] <= line[1][0] <= 2]
    low = [np.sort(np.round(line, 2), axis=0).tolist() for line in level.seen_low]
    assert all(line in low for line in found)
    assert [line for line in low if 1 <= line[0][0] <= line[1][0] <= 2]


def test_the_parts_of_a_mesh_have_bounds_in_each_storey_where_they_stand(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    walls = [[[x, 0, 0], [x + 0.2, 5, 2.6]] for x in (0, 6)] + [[[0.2, y, 0], [6, y + 0.2, 2.6]] for y in (0, 4.8)]
    for k, bounds in enumerate([*walls, [[0, 0, -0.1], [6.2, 5, 0]]]):
        scene.add_geometry(trimesh.creation.box(bounds=bounds), geom_name=f"wall{k}")
    scene.add_geometry(trimesh.creation.box(bounds=[[1, 3, 0], [2, 4, 1.2]]), geom_name="cupboard")
    scene.add_geometry(trimesh.creation.box(bounds=[[1, 3, 3.5], [2, 4, 4]]), geom_name="chimney")
    file = tmp_path / "house.obj"
    scene.export(file)
    config = config_of(file)
    (level,) = SourceReader(config, id_of(file)).record({}).levels
    parts = dict(level.parts)
    assert "chimney" not in parts
    corners = np.reshape(parts["cupboard"], (2, 2))
    assert np.sort(source_points_from_plan(level.frame, corners), axis=0) == pytest.approx(np.array([[1, 3], [2, 4]]))


@pytest.mark.slow
def test_the_parts_of_an_ifc_file_have_bounds_by_their_names_and_classes() -> None:
    file = FOLDER / "house.ifc"
    record = SourceReader(config_of(file), id_of(file)).record({})
    (level,) = record.levels
    assert Image.open(io.BytesIO(record.side.png)).size[0] > 100  # a picture from the side
    plan, parts = decode(bytes(level.plans[0].plan)), dict(level.parts)
    (kitchen,) = (room for room in plan.rooms if room.label == "Kitchen")
    corners = source_points_from_plan(plan.frame, np.reshape(kitchen.polygon.bounds, (2, 2)))
    assert np.reshape(parts["Küche"], (2, 2)) == pytest.approx(corners, abs=0.2)  # the level's frame is the source's
    assert parts["IfcSpace"][0] < parts["Küche"][0]


@pytest.mark.parametrize("height", [0.0, 0.3])
def test_a_file_without_a_storey_shows_its_lines_to_draw_along(tmp_path: Path, height: float) -> None:
    walls = [[[0, 0, 0], [6, 0.2, height]], [[0, 4, 0], [6, 4.2, height]]]
    file = tmp_path / "low.ply"
    trimesh.util.concatenate([trimesh.creation.box(bounds=bounds) for bounds in walls]).export(file)
    record = SourceReader(config_of(file), id_of(file)).record({})
    assert record.rejected
    (level,) = record.levels
    assert {each.kind for each in level.strokes} == {"section" if height else "outline"}
    corners = {tuple(np.round(point, 2)) for each in level.strokes for point in each.points}
    assert corners == {(x, y) for x in (0.0, 6.0) for y in (0.0, 0.2, 4.0, 4.2)}


def test_a_house_that_is_no_plan_shows_its_source_and_becomes_one_by_what_is_said(tmp_path: Path) -> None:
    parts = [
        trimesh.creation.box(bounds=[[0, 0, 0], [6, 0.2, 2.6]]),
        trimesh.creation.box(bounds=[[0, 0, -0.1], [6, 5, 0]]),
    ]
    file = tmp_path / "open.ply"
    trimesh.util.concatenate(parts).export(file)
    record = SourceReader(config_of(file), id_of(file)).record({})
    assert not any(level.plans for level in record.levels)
    assert record.rejected or record.levels[0].rejected
    (level,) = record.levels
    assert level.pictures
    said = {level.id: Override(room_outline=[[[0, 0.2], [0, 4], [5, 4], [5, 0.2]]])}
    (again,) = SourceReader(config_of(file), level.id).record(said).levels
    (plan,) = again.plans
    assert plan.is_founded
    assert len(json.loads(bytes(plan.plan))["rooms"]) == 1


def test_a_robots_map_is_shown_itself(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.05\norigin: [2.0, 3.0, 0.0]\n")
    cells = np.zeros((100, 160), np.uint8)
    cells[2:-2, 2:-2] = 254
    cells[2:-2, 79:81] = 0
    cells[40:60, 79:81] = 254
    Image.fromarray(cells).save(tmp_path / "map.pgm")
    file = tmp_path / "map.yaml"
    record = SourceReader(config_of(file), id_of(file)).record({})
    (picture,) = record.levels[0].pictures
    assert picture.name == "map"
    x1, y1, x2, y2 = picture.bounds
    assert (x2 - x1, y2 - y1) == pytest.approx((8.0, 5.0), abs=0.21)  # but for unseen cells at its edge


def test_a_point_cloud_is_shown_from_above_and_in_section(tmp_path: Path) -> None:
    file = write_pcd(tmp_path / "map.pcd", sampled(flat(), np.random.default_rng(0)))
    (level,) = SourceReader(config_of(file), id_of(file)).record({}).levels
    shown = {each.name: each for each in level.pictures}
    assert list(shown) == ["top", "section_1_1", "section_1_9"]
    assert level.solid is None
    (x1, _, x2, y2), image = shown["section_1_1"].bounds, Image.open(io.BytesIO(shown["section_1_1"].png))
    scale, (ox, oy) = image.width / (x2 - x1), (level.frame.matrix[0][2], level.frame.matrix[1][2])
    walls = np.asarray(image.getchannel("A"))[round((y2 - 0.5 + oy) * scale)]  # between the door and the corner
    for x, is_wall in ((4.0, True), (4.2, True), (2.0, False), (6.0, False)):
        column = round((x - ox - x1) * scale)
        assert walls[column - 4 : column + 5].any() == is_wall


def test_an_unknown_house_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="nobody: expected an id of this build"):
        SourceReader(config_of(FILE), "nobody").record({})


def test_worlds_of_one_id_are_told_apart_by_all_that_they_consist_of(tmp_path: Path) -> None:
    (tmp_path / "house.sdf").write_text(world(house()))
    (tmp_path / "house.world").write_text(world(house(), cube("crate", "1 1 0.3 0 0 0")))
    config = config_of(tmp_path)
    for item in list_inputs(config):
        (level,) = reader(item.reader).read(item)
        assert isinstance(level, Level)
        assert SourceReader(config, f"{item.id}_{level.content[:8]}").record({}).path == item.path


def test_inputs_of_one_id_are_told_apart_by_their_content(tmp_path: Path) -> None:
    for folder, width in (("a", 160), ("b", 200)):
        (tmp_path / folder / "maps").mkdir(parents=True)
        (tmp_path / folder / "maps" / "house.yaml").write_text(
            f"image: house.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n# {folder}\n"
        )
        cells = np.zeros((100, width), np.uint8)
        cells[2:-2, 2:-2] = 254
        Image.fromarray(cells).save(tmp_path / folder / "maps" / "house.pgm")
    files = [tmp_path / folder / "maps" / "house.yaml" for folder in ("a", "b")]
    build([str(file) for file in files], tmp_path / "ds", workers=1)
    config = load_build_config(None, {"sources": tuple(map(str, files))})
    names = open_dataset(tmp_path / "ds").ids
    assert len(names) == 2
    lengths = {}
    for name in names:
        view = _view(SourceReader(config, name).record({}), name)
        lengths[name] = view.level.extent[0]
    assert sorted(lengths.values()) == pytest.approx([7.8, 9.8], abs=0.3)
    longer = max(lengths, key=lambda name: lengths[name])
    (tmp_path / "ds" / "overrides.toml").write_text(f'[{longer}]\nlabel = [5.0, 2.5, "Office"]\n')
    build([str(file) for file in files], tmp_path / "ds", workers=1)
    labels = {name: [room.label for room in open_dataset(tmp_path / "ds")[name].rooms] for name in names}
    assert labels == {name: ["Office" if name == longer else "Unlabelled"] for name in names}


def test_a_line_that_a_geojson_file_calls_otherwise_can_be_said_to_be_a_wall(tmp_path: Path) -> None:
    found = collection()
    line = {"type": "LineString", "coordinates": [[4.2, 2.0], [8.2, 2.0]]}
    found["features"].append({"type": "Feature", "properties": {"category": "folding screen"}, "geometry": line})
    (tmp_path / "rooms.geojson").write_text(json.dumps(found))
    record = SourceReader(config_of(tmp_path / "rooms.geojson"), id_of(tmp_path / "rooms.geojson")).record({})
    assert "drop_nodes" not in record.takes
    (level,) = record.levels
    view = SourceView(record, level, level.plans[0])
    drawn = view.drawn_under(None)["strokes"]
    assert {"room", "door", "folding screen"} <= {each["kind"] for each in drawn}
    (points,) = [each["points"] for each in drawn if each["kind"] == "folding screen"]
    plan = view.plan
    assert plan is not None
    assert plan.frame is not None
    said = source_points_from_plan(plan.frame, points).round(3).tolist()
    corrected = correct_plan(plan, [Correction("wall", tuple(map(tuple, said)))], view.spaces)
    assert [effect.outcome for effect in corrected.effects] == ["done"]
    assert len(corrected.plan.rooms) == len(plan.rooms) + 1


def test_a_geojson_file_of_no_plan_shows_its_lines_of_which_a_person_makes_one(tmp_path: Path) -> None:
    corners = [[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]]
    sides = [list(side) for side in pairwise(corners)]
    features = [
        {"type": "Feature", "properties": {"name": "trait"}, "geometry": {"type": "LineString", "coordinates": side}}
        for side in sides
    ]
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    read = SourceReader(config_of(tmp_path / "a.geojson"), id_of(tmp_path / "a.geojson"))
    record = read.record({})
    assert "expected features that are called wall or room" in record.rejected
    (level,) = record.levels
    assert [(each.kind, [list(point) for point in each.points]) for each in level.strokes] == [
        ("trait", side) for side in sides
    ]
    assert len(level.pictures) == 1
    walls = tuple(tuple(map(tuple, side)) for side in sides)
    (level,) = read.record({record.id: Override(wall=walls)}).levels
    (found,) = level.plans
    assert [room.area for room in decode(bytes(found.plan)).rooms] == pytest.approx([4.9 * 3.9], rel=0.05)


def test_of_several_plans_of_a_house_that_had_none_the_largest_is_shown() -> None:
    reader_ = SourceReader(config_of(FILE), id_of(FILE))
    record = reader_.record({})
    (level,) = record.levels
    (plan,) = level.plans
    small = msgspec.structs.replace(plan, id="a_B1", plan=msgspec.Raw(encode(two_rooms("small"))))
    large = msgspec.structs.replace(plan, id="a_B2")
    both = msgspec.structs.replace(level, plans=(small, large))
    found = _view(msgspec.structs.replace(record, levels=(both,)), record.id)
    assert found.found is large


@pytest.mark.parametrize(("layer", "rooms"), [("PIPES", 2), ("INNER", 1)])
def test_lines_of_a_layer_that_are_no_walls_leave_the_rooms_that_others_enclose(
    tmp_path: Path, layer: str, rooms: int
) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010", units=6)
    outer = [(0, 0), (8, 0), (8, 4), (0, 4)]
    drawn = {
        "OUTER": pairwise([*outer, outer[0]]),
        "INNER": [((4, 0), (4, 4))],
        "PIPES": [*pairwise([(4, 1.5), (5, 1.5), (5, 2), (4, 2), (4, 1.5)]), ((3.95, 2.5), (3.95, 3.5))],
    }
    for name, lines in drawn.items():
        for start, end in lines:
            document.modelspace().add_line(start, end, dxfattribs={"layer": name})
    document.saveas(tmp_path / "plan.dxf")
    config, name = config_of(tmp_path / "plan.dxf"), id_of(tmp_path / "plan.dxf")
    (level,) = SourceReader(config, name).record({}).levels
    view = SourceView(SourceReader(config, name).record({}), level, level.plans[0])
    base = view.plan
    assert base is not None
    assert base.frame is not None
    assert len(base.rooms) == 2
    pieces = [pair for each in level.strokes if each.kind == layer for pair in pairwise(each.points)]
    origin = np.array(view.origin)
    there = [source_points_from_plan(base.frame, np.array(pair) - origin).round(3).tolist() for pair in pieces]
    said = Override(no_wall=there).corrections
    told = preview(base, said, base, view.spaces, view.standing, walls=view.walls, lines=view.lines)
    assert len(told.plan.rooms) == rooms
    (item,) = list_inputs(config)
    (read,) = (each for each in reader(item.reader).read(item) if isinstance(each, Level))
    built = plan_largest_building(replace(read, corrections=said), config.planning, level_rng(read, 0))
    assert [record["said"] for record in told.records] == [
        record["said"] for record in (built.provenance or {})["corrections"]
    ]
    assert [room.ring.tolist() for room in told.plan.rooms] == [room.ring.tolist() for room in built.rooms]
