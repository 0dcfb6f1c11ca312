"""Houses of sheets: one or two a wall, faces that look anywhere, turned so that coincident ones no longer coincide."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from pipeline.values import Mesh
from tests.builders.houses import Hole, Parts, kinds, level, plan_of, sheet_wall
from tests.builders.meshes import joined, turned

DOOR = Hole(0.05, 1.09, 0.0, 2.1)
WIDE = Hole(0.8, 2.74, 0.0, 2.1)


def flipped(parts: Parts) -> Parts:
    return [trimesh.Trimesh(part.vertices, part.faces[:, ::-1], process=False) for part in parts]


def three_rooms(double: bool, look: str) -> Parts:
    """3 x 4 m and 2 x 4 m side by side, 5 x 2 m over both; a room's sheets run counter-clockwise around it."""
    left = [((0, 0), (3, 0)), ((3, 0), (3, 4)), ((3, 4), (0, 4)), ((0, 4), (0, 0))]
    right = [((3, 0), (5, 0)), ((5, 0), (5, 4)), ((5, 4), (3, 4)), ((3, 4), (3, 0))]
    upper = [((0, 4), (3, 4)), ((3, 4), (5, 4)), ((5, 4), (5, 6)), ((5, 6), (0, 6)), ((0, 6), (0, 4))]
    holes = {frozenset([(3, 0), (3, 4)]): DOOR, frozenset([(0, 4), (3, 4)]): WIDE}
    parts: Parts = []
    seen: set[frozenset[tuple[int, int]]] = set()
    for k, (a, b) in enumerate([*left, *right, *upper]):
        key = frozenset([a, b])
        if key in seen and not double:
            continue
        seen.add(key)
        hole = holes.get(key)
        if hole and a > b:  # holes are measured from a wall's start
            length = float(np.hypot(a[0] - b[0], a[1] - b[1]))
            hole = Hole(length - hole.end, length - hole.start, hole.low, hole.high)
        sheets = sheet_wall(a, b, *([hole] if hole else []))
        parts += flipped(sheets) if look == "in" or (look == "mixed" and k % 2) else sheets
    return parts


def as_stored(mesh: Mesh) -> Mesh:
    """Vertices as a file of single precision holds them."""
    return Mesh(mesh.vertices.astype(np.float32).astype(np.float64), mesh.faces)


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("look", ["out", "in", "mixed"])
@pytest.mark.parametrize("degrees", [0, 17, 45])
def test_sheets_make_rooms_and_doors_whichever_way_they_look(double: bool, look: str, degrees: float) -> None:
    plan = plan_of(level(as_stored(turned(joined(three_rooms(double, look)), degrees, (0.3, 0.7, 0.0)))))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([8.0, 10.0, 12.0], rel=0.04)
    assert kinds(plan) == ["door", "door"]
    assert sorted(door.width for door in plan.doors) == pytest.approx([1.04, 1.94], abs=0.02)


def test_two_sheets_with_a_slit_between_them_are_one_wall() -> None:
    house = joined(three_rooms(double=False, look="out"))
    moved = house.vertices + np.array([0.003, 0.002, 0.0])
    mesh = Mesh(np.concatenate([house.vertices, moved]), np.concatenate([house.faces, house.faces + len(moved)]))
    plan = plan_of(level(mesh))
    assert len(plan.rooms) == 3
    assert kinds(plan) == ["door", "door"]


WINDOW = Hole(0.6, 1.4, 0.9, 2.0)


@pytest.mark.parametrize("degrees", [12.2, 17, 45])
def test_no_crack_beside_a_window_lets_the_outside_in(degrees: float) -> None:
    """Rounding leaves one in a few houses, where wall and window are put together."""
    corners = [(0, 0), (4, 0), (4, 3), (0, 3)]
    around = [sheet_wall(a, b, WINDOW) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    house = turned(joined([part for parts in around for part in parts]), degrees, (57.1, 364.2, 0.0))
    assert sum(room.area for room in plan_of(level(as_stored(house))).rooms) == pytest.approx(12.0, rel=0.04)
