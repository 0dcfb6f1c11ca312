"""Webots worlds: walls, doors and windows with z up and with y up, named floors, and what is refused or left out."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import shapely

from houseexpo.floorplan import FloorPlan
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from tests.builders.round_trip import plans_of

Z_UP, Y_UP = "#VRML_SIM R2023b utf8", "#VRML_SIM R2020a utf8"


def node(
    kind: str, x: float, y: float, length: float, *, across: bool = False, y_up: bool = False, more: str = ""
) -> str:
    """A Wall, Door or Window of the manual, 0.2 m thick and 2.5 m high, along x or across it."""
    at, size = ((x, 0, -y), (length, 2.5, 0.2)) if y_up else ((x, y, 0), (0.2, length, 2.5))
    turned = across if y_up else not across
    axis = "0 1 0" if y_up else "0 0 1"
    angle = math.pi / 2 if turned else 0.0
    numbers = " ".join(f"{each:g}" for each in size)
    place = " ".join(f"{each:g}" for each in at)
    fields = f'translation {place}\n  rotation {axis} {angle}\n  name "{kind.lower()}"\n  size {numbers}\n{more}'
    return f"{kind} {{\n  {fields}}}\n"


def world(y_up: bool = False, head: str = "", more: str = "") -> str:
    """Two rooms of 4 x 3 m with a door between them, a window and a door outside; furniture is a PROTO."""
    parts = [
        node("Wall", 4.1, -0.1, 8.6, y_up=y_up),
        node("Wall", 2.0, 3.1, 4.4, y_up=y_up),
        node("Window", 4.7, 3.1, 1.0, y_up=y_up),
        node("Wall", 6.8, 3.1, 3.2, y_up=y_up),
        node("Wall", -0.1, 1.5, 3.4, across=True, y_up=y_up),
        node("Wall", 8.3, 0.5, 1.0, across=True, y_up=y_up),
        node("Door", 8.3, 1.5, 1.0, across=True, y_up=y_up, more="  canBeOpen FALSE\n"),
        node("Wall", 8.3, 2.6, 1.2, across=True, y_up=y_up),
        node("Wall", 4.1, 0.5, 1.0, across=True, y_up=y_up),
        node("Door", 4.1, 1.4, 0.8, across=True, y_up=y_up, more="  doorHandle DoorLever { hasStaticParent TRUE }\n"),
        node("Wall", 4.1, 2.4, 1.2, across=True, y_up=y_up),
    ]
    sofa = "Sofa {\n  translation 1 1 0 # by the window\n}\n"
    return f"{head or (Y_UP if y_up else Z_UP)}\nWorldInfo {{\n  basicTimeStep 16\n}}\n{''.join(parts)}{sofa}{more}"


def plan_of(tmp_path: Path, text: str) -> FloorPlan:
    """The one plan of a world."""
    (tmp_path / "house.wbt").write_text(text)
    (plan,) = plans_of(tmp_path / "house.wbt")
    return plan


def refused(tmp_path: Path, text: str) -> Rejection:
    (tmp_path / "house.wbt").write_text(text)
    (item,) = find(str(tmp_path / "house.wbt"))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    return caught.value


@pytest.mark.parametrize("y_up", [False, True])
def test_a_world_of_walls_doors_and_windows(tmp_path: Path, y_up: bool) -> None:
    plan = plan_of(tmp_path, world(y_up))
    assert sorted(round(room.area, 1) for room in plan.rooms) == [12.0, 12.0]
    assert sorted(door.kind for door in plan.doors) == ["door", "entrance"]
    assert plan.provenance is not None
    assert plan.provenance["source"] == "webots"
    assert "1 Sofa" in plan.provenance["left_out"]
    assert plan.frame is not None
    assert plan.frame.up == ("y" if y_up else "z")


def test_both_axes_give_one_plan_at_its_place_in_the_world(tmp_path: Path) -> None:
    one, other = plan_of(tmp_path, world(False)), plan_of(tmp_path, world(True))
    assert shapely.equals_exact(one.outline.normalize(), other.outline.normalize(), 0.011)
    for plan in (one, other):
        assert plan.frame is not None
        (door,) = [door for door in plan.doors if door.kind == "door"]
        middle = np.array([*np.mean(door.segment, axis=0), 1.0])
        found = np.asarray(plan.frame.matrix) @ middle
        assert found == pytest.approx([4.1, 1.4 if plan.frame.up == "z" else -1.4], abs=0.02)


def test_the_world_names_its_axes_where_it_has_others_than_its_version(tmp_path: Path) -> None:
    text = world(True, head=Z_UP).replace("basicTimeStep 16", 'basicTimeStep 16\n  coordinateSystem "NUE"')
    assert len(plan_of(tmp_path, text).rooms) == 2


def test_floors_with_the_names_of_rooms_name_them(tmp_path: Path) -> None:
    floors = """DEF FLOOR Solid { translation 2 1.5 0 name "floor" children [
      DEF KITCHEN Transform { children [ Shape { geometry Plane { size 4, 3 } } ] }
      DEF BEDROOM_1 Pose { translation 4.2 0 0 children [ Shape { geometry Box { size 4 3 0.01 } } ] } ] }"""
    plan = plan_of(tmp_path, world(more=floors))
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]


def test_hidden_fields_in_which_webots_saves_states_are_read_over(tmp_path: Path) -> None:
    """Webots writes them into nodes of PROTOs that have moved, a Door among them."""
    saved = "Door {\n  hidden translation_5 0.001 9.87e-11 2.2e-15\n  hidden rotation_1 0 1 0 0.5\n  translation"
    text = world().replace("Door {\n  translation", saved)
    assert sorted(door.kind for door in plan_of(tmp_path, text).doors) == ["door", "entrance"]


def test_walls_that_are_plain_solids_count_by_their_names(tmp_path: Path) -> None:
    def box(name: str, at: str, size: str) -> str:
        return f'Solid {{ translation {at} name "{name}" children [ Shape {{ geometry Box {{ size {size} }} }} ] }}\n'

    def used(at: str) -> str:
        return f"Transform {{ translation {at} children [ USE SIDE ] }}\n"

    points = "0 -0.1 0, 4 -0.1 0, 4 0.1 0, 0 0.1 0, 0 -0.1 2.5, 4 -0.1 2.5, 4 0.1 2.5, 0 0.1 2.5"
    faces = "0 3 2 1 -1 4 5 6 7 -1 0 1 5 4 -1 1 2 6 5 -1 2 3 7 6 -1 3 0 4 7 -1"
    shape = (
        f"Shape {{ geometry IndexedFaceSet {{ coord Coordinate {{ point [ {points} ] }} coordIndex [ {faces} ] }} }}"
    )
    text = "\n".join(
        [
            Z_UP,
            box("wall south", "2 0 1.25", "4.2 0.2 2.5"),
            f'DEF SIDE Solid {{ rotation 0 0 1 1.5707963 name "wall side" children [ {shape} ] }}',
            used("4 0 0"),
            box("wall north", "2 4 1.25", "4.2 0.2 2.5"),
            box("cupboard", "1 1 0.5", "1 1 1"),
        ]
    )
    plan = plan_of(tmp_path, text)
    assert [round(room.area, 1) for room in plan.rooms] == [14.4]


def test_an_arena_has_the_walls_that_it_says(tmp_path: Path) -> None:
    arena = f"{Z_UP}\nRectangleArena {{ floorSize 5 4 wallThickness 0.1 wallHeight 2 }}\n"
    assert plan_of(tmp_path, arena).area == pytest.approx(20, abs=0.1)
    low = f"{Z_UP}\nRectangleArena {{ floorSize 5 4 }}\n"  # walls of 0.1 m: nothing stands there
    assert "found 1 nodes" in refused(tmp_path, low).detail


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (Z_UP, "expected Wall nodes"),
        (f"{Z_UP}\nSofa {{ }}\n", "found 1 nodes of other names"),
        (f"{Z_UP}\nWall {{\n  size 1 2\n", "line 4: expected a node or a field, found the end of the file"),
        (f"{Z_UP}\nWall {{ ] }}\n", "found ]"),
        (f"{Z_UP}\n{{ }}\n", "found {"),
        (Z_UP + "\n" + "Group { children [ " * 200, "deep"),
    ],
)
def test_what_is_no_world_is_refused_with_the_line(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(tmp_path, text).detail


def test_impossible_numbers_and_meshes_elsewhere_cost_only_their_node(tmp_path: Path) -> None:
    more = """Wall { translation nan 0 0 size 1e400 -1 x }
    Solid { name "wall" children [ Shape { geometry Mesh { url "../../secret.stl" } }
      Shape { geometry Mesh { url "https://example.org/wall.stl" } }
      Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0 ] } coordIndex [ 0 1 2 ] } } ] }"""
    plan = plan_of(tmp_path, world(more=more))
    assert plan.provenance is not None
    assert "'../../secret.stl' is not in the folder" in plan.provenance["left_out"]
    assert "names a point that is not there" in plan.provenance["left_out"]


def test_a_node_used_without_end_is_refused(tmp_path: Path) -> None:
    layers = "".join(f"DEF A{k + 1} Group {{ children [ {' '.join([f'USE A{k}'] * 10)} ] }}\n" for k in range(8))
    text = f"{Z_UP}\nDEF A0 Group {{ children [ Wall {{ }} ] }}\n{layers}"
    assert "nodes, expected 100,000 at most" in refused(tmp_path, text).detail
