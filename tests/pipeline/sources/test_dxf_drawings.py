"""Read DXF drawings as architects draw them: curves, fillings, outlines, and layers that say nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import shapely

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from pipeline.sources.vector_plans.dxf import find_metres_per_unit
from pipeline.sources.vector_plans.named_features import kind_from_name
from pipeline.values import Level
from tests.builders.houses import kinds, levels_of, plan_of

ezdxf = pytest.importorskip("ezdxf")

OUTER, INNER = (0.0, 0.0, 8.0, 4.0), (0.2, 0.2, 7.8, 3.8)


def ring(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]


def drawn(folder: Path, draw: Callable[[Any], None]) -> Level:
    drawing = ezdxf.new("R2010", units=6)
    draw(drawing.modelspace())
    drawing.saveas(folder / "plan.dxf")
    (level,) = levels_of(folder / "plan.dxf")
    return level


def test_bulges_and_arcs_are_walls_too(tmp_path):
    def draw(space: Any) -> None:
        for radius in (2.0, 2.2):
            half = [(-radius, 0.0, 1.0), (radius, 0.0, 0.0)]  # half a circle below
            space.add_lwpolyline(half, format="xyb", dxfattribs={"layer": "WALL"})
            space.add_arc((0, 0), radius, 0, 180, dxfattribs={"layer": "WALL"})

    plan = plan_of(drawn(tmp_path, draw))
    assert plan.area == pytest.approx(shapely.Point(0, 0).buffer(2.0).area, rel=0.02)


def test_what_is_filled_on_a_layer_of_walls_is_wall(tmp_path):
    def draw(space: Any) -> None:
        hatch = space.add_hatch(dxfattribs={"layer": "WALL"})
        hatch.paths.add_polyline_path(ring(*OUTER), is_closed=True, flags=1)
        hatch.paths.add_polyline_path(ring(*INNER), is_closed=True, flags=0)
        for corners in (OUTER, INNER):  # the same walls once more, as lines
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALL"})

    assert plan_of(drawn(tmp_path, draw)).area == pytest.approx(7.6 * 3.6, rel=0.01)


def test_a_closed_line_around_rooms_is_an_outline_and_no_massive_wall(tmp_path):
    def draw(space: Any) -> None:
        space.add_lwpolyline(ring(*OUTER), close=True, dxfattribs={"layer": "WALLS"})
        space.add_line((5, 0), (5, 4), dxfattribs={"layer": "WALLS"})
        space.add_text("Kitchen", height=0.2, dxfattribs={"layer": "TEXT"}).set_placement((2, 2))
        space.add_lwpolyline(ring(6, 1, 6.5, 1.5), close=True, dxfattribs={"layer": "WALLS"})  # a pillar

    plan = plan_of(drawn(tmp_path, draw))
    assert sorted(room.label for room in plan.rooms) == ["Kitchen", "Unlabelled"]
    assert plan.area == pytest.approx(32.0, rel=0.05)


def two_rooms(space: Any, layer: str = "0", open_deg: float = 0.0) -> None:
    """Draw two rooms with a door of 0.9 m between them: the faces of walls, the swing and the leaf."""
    space.add_lwpolyline(ring(*OUTER), close=True, dxfattribs={"layer": layer})
    for x1, x2 in ((0.2, 4.0), (4.1, 7.8)):
        way = [(x2, 1.0), (x2, 0.2), (x1, 0.2), (x1, 3.8), (x2, 3.8), (x2, 1.9)]
        if x1 > 4:
            way = [(x1, 1.0), (x1, 0.2), (x2, 0.2), (x2, 3.8), (x1, 3.8), (x1, 1.9)]
        space.add_lwpolyline(way, dxfattribs={"layer": layer})
    for y in (1.0, 1.9):
        space.add_line((4.0, y), (4.1, y), dxfattribs={"layer": layer})
    leaf = (4.1 + 0.9 * math.cos(math.radians(open_deg)), 1.0 + 0.9 * math.sin(math.radians(open_deg)))
    space.add_arc((4.1, 1.0), 0.9, open_deg, 90, dxfattribs={"layer": layer})
    space.add_line((4.1, 1.0), leaf, dxfattribs={"layer": layer})


def test_lines_of_layers_that_say_nothing_are_walls_and_arcs_doors(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space)
        space.add_line((1, 1), (3, 3), dxfattribs={"layer": "A-FURN"})
        space.add_line((-5, -5), (20, -5), dxfattribs={"layer": "DIM"})

    level = drawn(tmp_path, draw)
    assert level.guesses == ("layers",)
    plan = plan_of(level)
    assert sorted(room.area for room in plan.rooms) == pytest.approx([3.7 * 3.6, 3.8 * 3.6], rel=0.02)
    assert kinds(plan) == ["door"]


def test_leaves_of_two_doors_with_one_hinge_are_no_walls(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space)
        space.add_arc((4.1, 1.0), 0.8, 180, 270)
        space.add_line((3.3, 1.0), (4.1, 1.0))  # drawn towards the hinge

    walls = drawn(tmp_path, draw).walls.vertices
    for x in (3.6, 4.6):  # halfway along the leaves
        assert not (
            (abs(walls[:, 0] - x) < 0.7) & (abs(walls[:, 1] - 1.0) < 0.06) & (abs(walls[:, 0] - 4.05) > 0.1)
        ).any()


def test_layers_are_no_guess_where_one_says_wall(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space, "WALL")
        space.add_line((1, 0), (1, 4))

    level = drawn(tmp_path, draw)
    assert level.guesses == ()
    assert len(plan_of(level).rooms) == 2


def test_a_drawing_without_lines_names_its_layers(tmp_path):
    with pytest.raises(Rejection, match="expected layers that are called wall or room, found 0, Defpoints"):
        drawn(tmp_path, lambda space: space.add_line((0, 0), (4, 0), dxfattribs={"layer": "A-FURN"}))


def test_lines_called_room_enclose_rooms(tmp_path):
    def draw(space: Any) -> None:
        corners = ring(*OUTER)
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            space.add_line(start, end, dxfattribs={"layer": "room"})
        space.add_line((5, 0), (5, 4), dxfattribs={"layer": "room"})
        space.add_text("Kitchen", height=0.2, dxfattribs={"layer": "room_text"}).set_placement((2, 2))

    level = drawn(tmp_path, draw)
    assert sorted((room.labels, room.polygon.area) for room in level.rooms) == [((), 12.0), (("Kitchen",), 20.0)]


def test_closed_lines_side_by_side_with_names_are_rooms(tmp_path):
    def draw(space: Any) -> None:
        wall = {"layer": "Walls"}
        space.add_lwpolyline(ring(0, 0, 12, 8), close=True, dxfattribs=wall)  # around them all
        for name, corners in {"Kitchen": (0, 0, 5, 8), "Bedroom": (5, 0, 9, 4)}.items():
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs=wall)
            middle = (corners[0] + 1, corners[1] + 1)
            space.add_text(name, height=0.2, dxfattribs={"layer": "Labels"}).set_placement(middle)

    found = {room.label: room.area for room in plan_of(drawn(tmp_path, draw)).rooms}
    assert found == {
        "Kitchen": pytest.approx(40, rel=0.03),
        "Bedroom": pytest.approx(16, rel=0.03),
        "Unlabelled": pytest.approx(40, rel=0.03),
    }


def test_a_layer_called_room_that_holds_texts_alone_names_no_walls(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space)
        space.add_text("Kitchen", height=0.2, dxfattribs={"layer": "room"}).set_placement((2, 2))

    level = drawn(tmp_path, draw)
    assert level.guesses == ("layers",)
    assert "Kitchen" in {room.label for room in plan_of(level).rooms}


def test_an_arc_of_a_leaf_that_is_ajar_is_a_door(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space, open_deg=65)

    assert kinds(plan_of(drawn(tmp_path, draw))) == ["door"]


def test_layers_of_walls_with_a_pattern_taken_apart_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.sources.vector_plans.dxf.MOST_WALL_LINES", 1_000)

    def draw(space: Any) -> None:
        for i in range(1_001):
            space.add_line((0, i / 1000), (8, i / 1000), dxfattribs={"layer": "WALL"})

    with pytest.raises(Rejection, match="hold 1,001 lines, expected 1,000 at most"):
        drawn(tmp_path, draw)


def test_a_tangle_on_layers_that_say_nothing_is_no_plan(tmp_path):
    def draw(space: Any) -> None:
        for i in range(40):
            space.add_line((0, i), (40, i), dxfattribs={"layer": "PARTS"})
            space.add_line((i, 0), (i, 40), dxfattribs={"layer": "PARTS"})

    with pytest.raises(Rejection, match="no layer is called wall or room, and the lines of the others are a tangle"):
        drawn(tmp_path, draw)


@pytest.mark.parametrize(
    ("layer", "kind"),
    [
        ("A-WALL-PRTN", "wall"),
        ("A-320G - Permanent Solid Partitions 12", "wall"),
        ("墙体", "wall"),
        ("BS-柱", "wall"),
        ("隔断", "wall"),
        ("DS-半高隔断", ""),
        ("BS-梁", ""),
        ("门窗", "door"),
        ("Стены", "wall"),
        ("Дверь", "door"),
        ("PORTES PLACARD", "object"),
        ("A-DOOR-CABINET", "object"),
        ("Окна", "window"),
        ("pareti", "wall"),
        ("S-STEM-WALL", ""),
        ("I-321G - Virtual Partition", ""),
        ("A-ROOF", ""),
    ],
)
def test_words_of_layers(layer, kind):
    assert kind_from_name(layer) == kind


def open_faces(space: Any, scale: float = 1.0, layer: str = "MUROS") -> None:
    """Draw two rooms by faces that end free: the outer walls beyond the corners, the inner wall at a gap of 0.9 m."""

    def line(*corners: float) -> None:
        x1, y1, x2, y2 = (value * scale for value in corners)
        space.add_line((x1, y1), (x2, y2), dxfattribs={"layer": layer})

    for off in (-0.07, 0.07):
        line(0, off, 8, off)
        line(0, 4 + off, 8, 4 + off)
        line(off, 0, off, 4)
        line(8 + off, 0, 8 + off, 4)
        line(4 + off, 0, 4 + off, 1)
        line(4 + off, 1.9, 4 + off, 4)
    space.add_arc((4 * scale, scale), 0.9 * scale, 0, 90, dxfattribs={"layer": "PUERTAS"})


@pytest.mark.parametrize("layer", ["MUROS", "wal", "muratura"])
def test_two_faces_that_end_free_are_one_wall(tmp_path, layer):
    plan = plan_of(drawn(tmp_path, lambda space: open_faces(space, layer=layer)))
    assert [room.area for room in plan.rooms] == pytest.approx([3.86 * 3.86] * 2, rel=0.02)
    assert kinds(plan) == ["door"]


@pytest.mark.parametrize("scale", [1000.0, 1 / 0.0254])
def test_doors_tell_that_the_stated_unit_is_wrong(tmp_path, scale):
    """In metres, the arc would be 900 m or 35 m wide."""
    level = drawn(tmp_path, lambda space: open_faces(space, scale))
    assert level.guesses == ("units",)
    assert plan_of(level).area == pytest.approx(2 * 3.86**2 + 0.9 * 0.14, rel=0.02)


def test_millimetres_that_are_said_to_be_inches(tmp_path):
    """A house of 16 m is 406 m long in inches, which a site may be, but its doors are not."""
    drawing = ezdxf.new("R2000", units=1)
    open_faces(drawing.modelspace(), 2000)
    drawing.saveas(tmp_path / "plan.dxf")
    (level,) = levels_of(tmp_path / "plan.dxf")
    assert level.guesses == ("units",)
    assert plan_of(level).area == pytest.approx(4 * (2 * 3.86**2 + 0.9 * 0.14), rel=0.03)


def test_a_measure_beside_a_wall_is_no_face_of_it(tmp_path):
    def draw(space: Any) -> None:
        open_faces(space, layer="0")
        space.add_line((0, -0.55), (8, -0.55))

    assert [room.area for room in plan_of(drawn(tmp_path, draw)).rooms] == pytest.approx([3.86**2] * 2, rel=0.02)


def test_a_window_between_the_ends_of_walls_closes_the_house(tmp_path):
    def draw(space: Any) -> None:
        for off in (-0.07, 0.07):
            for corners in ((0, 4 + off, 6, 4 + off), (off, 0, off, 4), (6 + off, 0, 6 + off, 4)):
                space.add_line(corners[:2], corners[2:], dxfattribs={"layer": "WALL"})
            space.add_line((0, off), (1, off), dxfattribs={"layer": "WALL"})
            space.add_line((4, off), (6, off), dxfattribs={"layer": "WALL"})
        for off in (-0.03, 0.0, 0.03):
            space.add_line((1, off), (4, off), dxfattribs={"layer": "VENTANAS"})

    plan = plan_of(drawn(tmp_path, draw))
    assert plan.area == pytest.approx(5.86 * 3.86, rel=0.03)
    assert not plan.doors


def test_swings_of_polylines_and_of_stretched_blocks_are_doors(tmp_path):
    def draw(space: Any) -> None:
        open_faces(space)
        for arc in space.query("ARC"):
            space.delete_entity(arc)
        quarter = math.tan(math.pi / 8)
        space.add_lwpolyline(
            [(4.0, 1.0, 0.0), (4.9, 1.0, quarter), (4.0, 1.9, 0.0)], format="xyb", dxfattribs={"layer": "DOOR"}
        )

    assert kinds(plan_of(drawn(tmp_path, draw))) == ["door"]

    def stretch(space: Any) -> None:
        open_faces(space)
        for arc in space.query("ARC"):
            space.delete_entity(arc)
        block = space.doc.blocks.new("leaf")
        block.add_arc((0, 0), 1.0, 0, 90)
        nested = space.doc.blocks.new("door 90")
        nested.add_blockref("leaf", (0, 0), dxfattribs={"xscale": -0.8, "yscale": 0.9})
        space.add_blockref("door 90", (4, 1), dxfattribs={"layer": "0"})

    assert kinds(plan_of(drawn(tmp_path, stretch))) == ["door"]


def test_a_polyline_with_a_width_is_a_wall_of_this_width(tmp_path):
    def draw(space: Any) -> None:
        for corners in (ring(0, 0, 8, 4), ring(0, 0, 4, 4)):
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "WALL", "const_width": 0.2})

    plan = plan_of(drawn(tmp_path, draw))
    assert [room.area for room in plan.rooms] == pytest.approx([3.8 * 3.8] * 2, rel=0.01)


def test_a_drawing_that_is_one_block_is_read(tmp_path):
    def draw(space: Any) -> None:
        two_rooms(space.doc.blocks.new("the whole plan"))
        space.add_blockref("the whole plan", (100, 50), dxfattribs={"rotation": 90})

    level = drawn(tmp_path, draw)
    assert level.guesses == ("layers",)
    assert sorted(room.area for room in plan_of(level).rooms) == pytest.approx([3.7 * 3.6, 3.8 * 3.6], rel=0.02)


@pytest.mark.parametrize(("version", "form"), [("R12", "asc"), ("R2000", "bin"), ("R2018", "bin")])
def test_old_and_binary_files_are_read(tmp_path, version, form):
    drawing = ezdxf.new(version, units=6)
    open_faces(drawing.modelspace(), layer="WALL")
    drawing.saveas(tmp_path / "plan.dxf", fmt=form)
    (level,) = levels_of(tmp_path / "plan.dxf")
    assert len(plan_of(level).rooms) == 2


def test_letters_tell_the_unit_where_lines_of_walls_do_not(tmp_path):
    """Rooms of single lines, 12 m long in millimetres, said to be inches: 305 m, with letters of 6 m."""
    drawing = ezdxf.new("R2000", units=1)
    space = drawing.modelspace()
    for corners in (ring(0, 0, 12_000, 7_000), ring(0, 0, 5_000, 7_000)):
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "WALL"})
    for name, x in (("Kitchen", 1_000), ("Bedroom", 8_000)):
        space.add_text(name, height=250, dxfattribs={"layer": "TEXT"}).set_placement((x, 3_000))
    drawing.saveas(tmp_path / "plan.dxf")
    (level,) = levels_of(tmp_path / "plan.dxf")
    assert level.guesses == ("units",)
    assert plan_of(level).area == pytest.approx(84.0, rel=0.05)


def test_a_zip_of_drawings_is_read(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "house.zip", "w") as archive:
        for name, form in (("plans/ground.dxf", "asc"), ("plans/first.DXF", "bin")):
            drawing = ezdxf.new("R2000", units=6)
            open_faces(drawing.modelspace())
            drawing.saveas(tmp_path / "plan.dxf", fmt=form)
            archive.write(tmp_path / "plan.dxf", name)
        archive.writestr("readme.txt", "two storeys")
        archive.writestr("__MACOSX/plans/._ground.dxf", "nothing")
    items = list(find(str(tmp_path / "house.zip")))
    assert [item.key for item in items] == ["plans/first.DXF", "plans/ground.dxf"]
    levels = [level for item in items for level in reader(item.reader).read(item)]
    assert len({level.id for level in levels}) == 2
    assert [len(plan_of(level).rooms) for level in levels] == [2, 2]


def test_a_door_in_a_wall_of_one_line_is_no_deeper_where_another_line_ends(tmp_path):
    def draw(space: Any) -> None:
        space.add_lwpolyline(ring(0, 0, 14, 7.6), close=True, dxfattribs={"layer": "WALLS"})
        for ends in (((0, 3.6), (14, 3.6)), ((7, 3.6), (7, 7.6)), ((4, 0), (4, 3.6))):
            space.add_line(*ends, dxfattribs={"layer": "WALLS"})
        space.add_lwpolyline(ring(6.45, 3.57, 7.35, 3.63), close=True, dxfattribs={"layer": "DOORS"})

    level = drawn(tmp_path, draw)
    (opening,) = level.openings
    assert opening.polygon.area == pytest.approx(shapely.box(*opening.polygon.bounds).area)
    assert kinds(plan_of(level)).count("door") == 1


def test_closed_lines_side_by_side_are_rooms_though_nothing_is_in_them(tmp_path):
    def draw(space: Any) -> None:
        rooms = (ring(0, 0, 4, 3), ring(4.1, 0, 7, 3), ring(0, 3.1, 7, 4.3))
        for corners in (*rooms, ring(7.1, 0, 7.6, 0.5)):
            space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "WALLS"})

    level = drawn(tmp_path, draw)
    solid = shapely.union_all([each.area for each in level.walls.bodies])
    assert solid.contains(shapely.Point(7.35, 0.25))  # a pillar
    assert sorted(room.area for room in plan_of(level).rooms) == pytest.approx([8.4, 8.7, 12.0], rel=0.06)


def test_one_massive_block_alone_is_no_room(tmp_path):
    def draw(space: Any) -> None:
        for corners in (OUTER, INNER):
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALLS"})
        space.add_lwpolyline(ring(3, 1, 5, 3), close=True, dxfattribs={"layer": "WALLS"})

    assert plan_of(drawn(tmp_path, draw)).area == pytest.approx(7.6 * 3.6 - 4.0, rel=0.01)


def test_a_drawing_that_states_millimetres_is_not_in_feet():
    """Old masonry of 0.64 m, drawn in metres: in feet, it would be as thick as walls mostly are."""
    outer, inner = ring(0, 0, 23, 9), ring(0.64, 0.64, 22.36, 8.36)
    outlines = [[*each, each[0]] for each in (outer, inner)]
    assert find_metres_per_unit(outlines, [], [0.2], 0.001, "plan.dxf") == (1.0, False)
    assert find_metres_per_unit(outlines, [], [0.2], None, "plan.dxf") == (0.3048, False)


def test_a_sound_drawing_is_read_without_mending(tmp_path, monkeypatch):
    def draw(space: Any) -> None:
        for corners in (OUTER, INNER):
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALLS"})

    level = drawn(tmp_path, draw)
    monkeypatch.setattr("ezdxf.recover.read", lambda _: pytest.fail("it was mended"))
    assert plan_of(drawn(tmp_path, draw)).area == plan_of(level).area


@pytest.mark.parametrize("closed", [True, False])
def test_one_closed_line_alone_is_the_outline_of_a_room(tmp_path, closed):
    def draw(space: Any) -> None:
        corners = ring(0, 0, 6, 4)
        space.add_lwpolyline(corners if closed else [*corners, corners[0]], close=closed)

    assert plan_of(drawn(tmp_path, draw)).area == pytest.approx(24.0, rel=0.02)


def test_a_closed_line_with_pillars_is_an_outline(tmp_path):
    def draw(space: Any) -> None:
        space.add_lwpolyline(ring(0, 0, 20, 10), close=True, dxfattribs={"layer": "WALL"})
        for x in (5.0, 15.0):
            space.add_circle((x, 5), 0.3, dxfattribs={"layer": "COLUMN"})

    plan = plan_of(drawn(tmp_path, draw))
    assert plan.area == pytest.approx(200.0 - 2 * math.pi * 0.3**2, rel=0.01)
    assert len(plan.holes) == 2


@pytest.mark.parametrize("through", [True, False])
@pytest.mark.parametrize("turned", [False, True])
def test_a_leaf_that_opens_against_a_wall_is_no_passage_of_it(tmp_path, through, turned):
    """A door beside the wall between two rooms: its open leaf lies at that wall, or in it."""

    def draw(space: Any) -> None:
        def wall(*corners: float) -> None:
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALLS"})

        for corners in ((0, 0, 8, 0.1), (0, 3.9, 8, 4), (0, 0, 0.1, 4), (7.9, 0, 8, 4)):
            wall(*corners)
        wall(3.95, 1.6, 4.05, 4)  # between the rooms
        wall(0, 1.5, 2, 1.6)  # the wall of a corridor, with a door on each side of it
        wall(2.9, 1.5, 4.05, 1.6)
        wall(4.95, 1.5, 8, 1.6)
        hinge = 4.0 if through else 4.06
        space.add_arc((2.0, 1.6), 0.9, 0, 90, dxfattribs={"layer": "DOORS"})
        space.add_arc((hinge, 1.6), 0.95 - (hinge - 4.0), 0, 90, dxfattribs={"layer": "DOORS"})
        if turned:
            for each in space:
                each.transform(ezdxf.math.Matrix44.z_rotate(0.5))

    plan = plan_of(drawn(tmp_path, draw))
    assert sorted(round(room.area) for room in plan.rooms) == [9, 9, 11]
    assert kinds(plan) == ["door", "door"]


def test_a_window_on_a_layer_of_doors_and_windows_is_no_door(tmp_path):
    def draw(space: Any, layer: str) -> None:
        for corners in ((0, 0, 2, 0.2), (3, 0, 6, 0.2), (0, 3.8, 2, 4), (4, 3.8, 6, 4), (0, 0, 0.2, 4), (5.8, 0, 6, 4)):
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALLS"})
        about = {"layer": layer}
        space.add_arc((2, 0.2), 1.0, 0, 90, dxfattribs=about)
        space.add_line((2, 0.2), (2, 1.2), dxfattribs=about)
        space.add_lwpolyline(ring(2, 0, 3, 0.2), close=True, dxfattribs=about)  # the sill
        space.add_lwpolyline(ring(2, 3.8, 4, 4), close=True, dxfattribs=about)
        space.add_line((2, 3.9), (4, 3.9), dxfattribs=about)

    for layer in ("Doors & Windows", "门窗"):
        plan = plan_of(drawn(tmp_path, lambda space, layer=layer: draw(space, layer)))
        assert plan.area == pytest.approx(5.6 * 3.6, rel=0.02)
        (entrance,) = plan.doors
        assert entrance.kind == "entrance"
        assert float(shapely.LineString(entrance.segment).length) == pytest.approx(1.0, abs=0.1)


def test_a_damaged_block_costs_no_more_than_itself(tmp_path):
    def draw(space: Any) -> None:
        block = space.doc.blocks.new("BIN")
        block.add_blockref("INNER", (0, 0), dxfattribs={"xscale": 1.0})
        space.doc.blocks.new("INNER").add_line((0, 0), (1, 1))
        space.add_blockref("BIN", (1, 1), dxfattribs={"xscale": 1e-200, "yscale": 1e-200, "zscale": 1e-200})
        for corners in (OUTER, INNER):
            space.add_lwpolyline(ring(*corners), close=True, dxfattribs={"layer": "WALLS"})

    level = drawn(tmp_path, draw)
    assert plan_of(level).area == pytest.approx(7.6 * 3.6, rel=0.01)
    assert "block" in str(level.provenance)


def test_beams_of_a_drawing_without_names_are_no_walls(tmp_path):
    def draw(space: Any) -> None:
        for corners in (OUTER, INNER):
            space.add_lwpolyline(ring(*corners), close=True)
        for y in (1.9, 2.1):
            space.add_line((0.2, y), (7.8, y), dxfattribs={"layer": "BS-梁"})

    assert [round(room.area) for room in plan_of(drawn(tmp_path, draw)).rooms] == [27]


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_polylines_that_people_write_by_hand_are_read(tmp_path, ends):
    """Without a version, tables and marks of subclasses."""
    ways = (((0, 0), (8, 0), (8, 6), (0, 6)), ((5, 0), (5, 2)), ((5, 3), (5, 6)))
    tags: list[object] = [0, "SECTION", 2, "HEADER", 9, "$INSUNITS", 70, 6, 0, "ENDSEC", 0, "SECTION", 2, "ENTITIES"]
    for way in ways:
        tags += [0, "LWPOLYLINE", 8, "WALL", 62, 7, 90, len(way), 70, int(len(way) > 2)]
        tags += [each for x, y in way for each in (10, x, 20, y)]
    tags += [0, "CIRCLE", 8, "COLUMN", 10, 2, 20, 2, 40, 0.2, 0, "ENDSEC", 0, "EOF"]
    (tmp_path / "plan.dxf").write_text(ends.join(map(str, tags)) + ends, newline="")
    (level,) = levels_of(tmp_path / "plan.dxf")
    assert sorted(round(room.area) for room in plan_of(level).rooms) == [18, 30]


@pytest.mark.parametrize("off", [0.0, 0.08])
def test_leaves_that_are_drawn_by_eye_are_no_walls(tmp_path, off):
    """Single lines, through which the walls go on under the doors; the leaves stand ajar, ``off`` their arcs."""

    def draw(space: Any) -> None:
        space.add_lwpolyline(ring(0, 0, 8, 6), close=True)
        space.add_line((0, 2), (8, 2))
        space.add_line((4, 2), (4, 6))
        for x in (1.0, 6.0):
            space.add_arc((x, 2), 0.9, 0, 22)
            angle = math.radians(22)
            space.add_line((x + off / 2, 2 + off / 4), (x + 0.9 * math.cos(angle), 2 + 0.9 * math.sin(angle) - off))
        space.add_arc((8, 0.5), 0.9, 90, 120)
        space.add_line((8, 0.5), (8 - 0.45 - off, 0.5 + 0.78))

    plan = plan_of(drawn(tmp_path, draw))
    assert sorted(round(room.area) for room in plan.rooms) == [16, 16, 16]
    assert kinds(plan) == ["door", "door", "entrance"]


@pytest.mark.parametrize(("layer", "is_house"), [("muratura", True), ("0", False)])
def test_named_walls_of_plans_side_by_side_are_no_characters(tmp_path, layer, is_house):
    """Three storeys on a sheet, with thick walls and a way in, but no doors."""

    def draw(space: Any) -> None:
        for x in (0.0, 9.0, 18.0):
            way = [(2.5, 0.6), (0.6, 0.6), (0.6, 4.4), (4.4, 4.4), (4.4, 0.6), (3.5, 0.6)]
            outer = [(3.5, 0), (5, 0), (5, 5), (0, 5), (0, 0), (2.5, 0)]
            space.add_lwpolyline([(x + a, b) for a, b in [*way, *outer]], close=True, dxfattribs={"layer": layer})

    level = drawn(tmp_path, draw)
    if is_house:
        assert plan_of(level).area == pytest.approx(3.8 * 3.8, rel=0.1)
        return
    with pytest.raises(Rejection) as caught:
        plan_of(level)
    assert caught.value.reason is Reason.CHARACTERS
