import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from houseexpo.errors import ConfigError
from pipeline.geometry.cutting import Cutter
from pipeline.geometry.walls import section as wall_section
from pipeline.rejection import Reason, Rejection
from pipeline.sources import ifc, mesh_file
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.values import Input, Level

pytest.importorskip("ifcopenshell")

from tests.builders.houses import plan_of
from tests.builders.ifc import TinyBuilding, tiny_house

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
CASES = [path for path in sorted((DATA / "cases").glob("*.json")) if '"ifc"' in path.read_text()]
needs_data = pytest.mark.skipif(not CASES, reason="needs the development data beside the repository")


def read(path: Path) -> list[Level]:
    return [level for item in ifc.find(str(path)) for level in ifc.read(item)]


@cache
def storey_of(case: Path) -> tuple[dict[str, Any], Level]:
    """Return a case's truth and the level read from its IFC file."""
    truth = json.loads(case.read_text())
    levels = read(DATA / truth["ifc"])
    return truth, next(level for level in levels if level.provenance["storey"] == truth["storey"])


def in_source_axes(level: Level, shape: shapely.Geometry) -> shapely.Geometry:
    """Take a shape of the level frame back to the file's axes."""
    shift = np.asarray(level.frame.matrix)[:, 2]
    return shapely.transform(shape, lambda points: points + shift)


def section_area(level: Level, height: float) -> shapely.Geometry:
    """What stands at a height, as areas."""
    found = wall_section(Cutter(level.walls).cut(height), sheet_m=0.05, solid_m=0.7)
    return shapely.union_all([found.walls, found.solids])


def section(level: Level, height: float) -> shapely.Geometry:
    """Outline of what stands at a height, from the raw segments."""
    surfaces = Surfaces.of(level.walls)
    return shapely.union_all(shapely.linestrings(cut_at_height(surfaces, surfaces.walls(), height)), grid_size=1e-4)


@pytest.mark.parametrize(("schema", "unit_m"), [("IFC4", 1.0), ("IFC4", 0.001), ("IFC2X3", 1.0), ("IFC2X3", 0.01)])
def test_storeys_with_walls_become_levels_in_metres(tmp_path, schema, unit_m):
    ground, upper = read(tiny_house(schema, unit_m).write(tmp_path / "house.ifc"))
    assert [level.id for level in (ground, upper)] == [f"{tmp_path.name}_house_L{n}".replace("-", "_") for n in (0, 1)]
    assert (ground.frame.floor, upper.frame.floor) == pytest.approx((0.0, 2.8))
    assert (ground.ceiling_m, upper.ceiling_m) == pytest.approx((2.75, 2.5), abs=0.01)
    assert (ground.provenance["storey"], ground.provenance["schema"]) == ("EG", schema)
    for level in (ground, upper):
        assert section(level, 1.0).bounds == pytest.approx((0.0, 0.0, 8.0, 6.0), abs=1e-4)
        assert level.floor is not None
        assert level.floor.area == pytest.approx(48.0, abs=0.01)


def test_rooms_keep_their_words_and_get_labels(tmp_path):
    ground, upper = read(tiny_house().write(tmp_path / "house.ifc"))
    assert [room.words for room in ground.rooms] == [("Küche", "1"), ("Wohnen", "2")]
    assert [room.labels for room in (*ground.rooms, *upper.rooms)] == [("Kitchen",), ("Living_Room",), ("Bedroom",), ()]
    assert ground.room_count == upper.room_count == 2
    assert ground.rooms[0].polygon is not None
    assert ground.rooms[0].polygon.equals(shapely.box(0.2, 0.2, 4.0, 5.8))


def test_openings_tell_doors_from_gaps_and_leave_windows_out(tmp_path):
    ground, upper = read(tiny_house().write(tmp_path / "house.ifc"))
    found = sorted((opening.polygon.bounds, opening.has_door) for opening in ground.openings)
    assert [door for _, door in found] == [True, True]
    assert found[0][0] == pytest.approx((1.0, 0.0, 2.0, 0.2), abs=0.01)  # through the wall and no farther
    (gap,) = upper.openings
    assert not gap.has_door
    assert gap.polygon.bounds == pytest.approx((4.0, 2.0, 4.2, 2.9), abs=0.01)
    assert ground.named_openings


def test_furniture_leaves_and_railings_are_no_walls(tmp_path):
    ground, upper = read(tiny_house().write(tmp_path / "house.ifc"))
    room = shapely.box(0.3, 0.3, 3.8, 5.7)
    assert section(ground, 0.5).intersection(room).is_empty
    assert section(upper, 0.5).intersection(shapely.box(4.3, 0.3, 7.7, 5.7)).is_empty
    doorway = shapely.LineString([(4.1, 2.05), (4.1, 2.85)])
    assert not section(ground, 1.0).intersects(doorway)


def test_a_house_far_away_is_brought_near(tmp_path):
    near, far = tiny_house(), tiny_house(unit_m=0.001, shift=(50_000.0, -30_000.0))
    (still, _), (moved, _) = read(near.write(tmp_path / "a.ifc")), read(far.write(tmp_path / "b.ifc"))
    assert np.abs(moved.walls.vertices).max() < 20.0
    shift = np.asarray(moved.frame.matrix)[:, 2]
    back = shapely.transform(moved.rooms[0].polygon, lambda points: points + shift)
    assert back.bounds == pytest.approx((50_000.2, -29_999.8, 50_004.0, -29_994.2), abs=1e-3)
    assert len(moved.walls.faces) == len(still.walls.faces)


def test_in_a_file_without_walls_proxies_are_the_walls(tmp_path):
    house = TinyBuilding()
    storey = house.storey("Level 0", 0.0)
    for x1, y1, x2, y2 in ((0, 0, 6, 0.2), (0, 3.8, 6, 4), (0, 0.2, 0.2, 3.8), (5.8, 0.2, 6, 3.8)):
        house.element("IfcBuildingElementProxy", storey, (x1, y1, 0, x2, y2, 2.5), "box")
    (level,) = read(house.write(tmp_path / "proxies.ifc"))
    assert len(level.walls.faces) == 48
    assert level.room_count is None
    assert not level.named_openings


def rejection(path: Path) -> Rejection:
    with pytest.raises(Rejection) as caught:
        read(path)
    assert caught.value.stage == "source"
    assert caught.value.advice
    return caught.value


def test_bad_files_are_rejected(tmp_path):
    whole = tiny_house().write(tmp_path / "whole.ifc").read_bytes()
    cases = {
        "empty": (b"", Reason.EMPTY),
        "garbage": (np.random.default_rng(1).bytes(4000), Reason.UNREADABLE),
        "truncated": (whole[: len(whole) // 2], Reason.UNREADABLE),
        "header": (whole[:60] + b"\nEND-ISO-10303-21;\n", Reason.UNREADABLE),
    }
    for name, (content, reason) in cases.items():
        path = tmp_path / f"{name}.ifc"
        path.write_bytes(content)
        assert rejection(path).reason is reason
    assert rejection(tmp_path / "missing.ifc").reason is Reason.MISSING_FILE


def test_a_building_without_walls_or_storeys_has_no_level(tmp_path):
    house = TinyBuilding()
    assert rejection(house.write(tmp_path / "none.ifc")).reason is Reason.NO_LEVEL
    house.element("IfcSlab", house.storey("Dach", 3.0), (0, 0, 3, 8, 6, 3.2))
    assert rejection(house.write(tmp_path / "slab.ifc")).reason is Reason.NO_LEVEL


@pytest.mark.parametrize(("gap", "levels"), [(0.2, 1), (0.0, 0)])
def test_spaces_without_walls_get_walls_where_they_leave_room_for_them(tmp_path, gap, levels):
    house = TinyBuilding()
    storey = house.storey("EG", 0.0)
    for k in range(4):
        x, y = (4 + gap) * (k % 2), (3 + gap) * (k // 2)
        house.space(storey, (x, y, 0, x + 4, y + 3, 2.5), f"{k}", "Zimmer")
    path = house.write(tmp_path / "study.ifc")
    if not levels:
        assert rejection(path).reason is Reason.NO_LEVEL
        return
    (level,) = read(path)
    assert len(level.rooms) == 4
    assert [room.area for room in plan_of(level).rooms] == pytest.approx([12.0] * 4, rel=0.01)


def test_a_walled_storey_with_a_slab_counts_though_only_another_has_rooms(tmp_path):
    house = TinyBuilding()
    for k, name in enumerate(("EG", "OG")):
        storey = house.storey(name, 3.0 * k)
        house.walls_around(storey, (0, 0, 3.0 * k, 8, 6, 3.0 * k + 2.8))
        house.element("IfcSlab", storey, (0, 0, 3.0 * k - 0.2, 8, 6, 3.0 * k))
        if k == 0:
            house.space(storey, (0.2, 0.2, 0, 7.8, 5.8, 2.5), "1", "Zimmer")
    assert len(read(house.write(tmp_path / "two.ifc"))) == 2


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    path = tiny_house().write(tmp_path / "house.ifc")
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    assert ".[ifc]" in rejection(path).advice


def test_options_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="units"):
        list(ifc.find(str(tmp_path), units="mm"))


def matched(truth: list[shapely.Polygon], found: list[shapely.Polygon]) -> list[float]:
    """For each shape the best intersection over union among those found."""
    return [max(a.intersection(b).area / a.union(b).area for b in found) for a in truth]


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_real_rooms_are_those_of_the_case(case):
    truth, level = storey_of(case)
    assert level.frame.floor == pytest.approx(truth["floor_z"], abs=0.2)  # where people stand, not the raw slab
    rooms = [shapely.Polygon(room["polygon"], room["holes"]) for room in truth["rooms"]]
    found = [in_source_axes(level, room.polygon) for room in level.rooms if room.polygon]
    assert min(matched(rooms, found)) > 0.98
    for room, shape in zip(truth["rooms"], rooms, strict=True):
        best = max(level.rooms, key=lambda each: in_source_axes(level, each.polygon).intersection(shape).area)
        assert room["label"] in best.words


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_real_doors_are_all_found_and_nothing_else(case):
    truth, level = storey_of(case)
    places = [np.asarray(door["centre"]) for door in truth["doors"]]
    doors = [in_source_axes(level, each.polygon).centroid for each in level.openings if each.has_door]
    assert len(doors) == len(places)
    for place, door in zip(places, truth["doors"], strict=True):
        near = min(level.openings, key=lambda each: in_source_axes(level, each.polygon).distance(shapely.Point(place)))
        assert in_source_axes(level, near.polygon).centroid.distance(shapely.Point(place)) < 0.35
        assert near.has_door
        sides = np.hypot(*np.diff(np.asarray(near.polygon.exterior.coords)[:3], axis=0).T)
        assert np.abs(sides - door["width"]).min() < 0.2
    assert level.named_openings
    assert len(level.leaves) == len(places)


@pytest.mark.slow
@needs_data
@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_real_walls_hold_those_of_the_mesh_and_stand_in_no_room(case):
    truth, level = storey_of(case)
    rooms = shapely.union_all([shapely.Polygon(room["polygon"], room["holes"]).buffer(-0.1) for room in truth["rooms"]])
    standing = in_source_axes(level, section_area(level, 0.3))
    assert standing.intersection(rooms).area < 0.02 * rooms.area
    if truth["mesh"].endswith(".ply"):
        mesh, *_ = mesh_file.read(Input("case", "mesh_file", str(DATA / truth["mesh"])))
        lines = in_source_axes(mesh, section(mesh, level.frame.floor + 0.3 - mesh.frame.floor))
        found = in_source_axes(level, section(level, 0.3))
        assert lines.intersection(found.buffer(0.03)).length > 0.94 * lines.length  # some meshes hold stairs


def test_through_a_hole_in_a_slab_the_storey_below_shows(tmp_path):
    house = TinyBuilding()
    for name, z, slabs in (("EG", 0.0, [(0, 0, 8, 6)]), ("OG", 2.8, [(0, 0, 5, 6), (5, 4, 8, 6)])):
        storey = house.storey(name, z)
        house.walls_around(storey, (0, 0, z, 8, 6, z + 2.5))
        for x1, y1, x2, y2 in slabs:
            house.element("IfcSlab", storey, (x1, y1, z - 0.3, x2, y2, z), "floor")
    house.element("IfcStairFlight", storey, (5, 0.2, 0.0, 7.8, 4, 2.8), "stair")
    ground, upper = read(house.write(tmp_path / "house.ifc"))
    assert ground.below is None
    assert upper.below is not None
    assert upper.below.equals(shapely.box(5, 0, 8, 4))
