"""Kinds of solid walls that other tests do not have: walls in courses, chimneys, thick walls, turned open plans."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
import trimesh

from houseexpo.floorplan import FloorPlan
from pipeline.sources.meshes.formats import Convention
from pipeline.sources.storeys.size import Wish, detect
from tests.builders.houses import CEILING, HEAD, Hole, Parts, kinds, level, plan_of, shell, two_rooms, wall
from tests.builders.meshes import joined, turned

DOOR = Hole(1.0, 1.9)


def in_courses(
    solids: shapely.Geometry, doorways: shapely.Geometry, bands: tuple[float, ...] = (0.0, HEAD, CEILING)
) -> Parts:
    """Extrude a plan course by course, as one body each: the doorways are open in all but the last."""
    parts: Parts = []
    for low, high in pairwise(bands):
        shape = solids.difference(doorways) if high < CEILING else solids
        for piece in shapely.get_parts(shape):
            body = trimesh.creation.extrude_polygon(piece, high - low)
            body.apply_translation((0.0, 0.0, low))
            parts.append(body)
    return parts


def flat(inner_m: float = 0.2, outer_m: float = 0.2) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Two rooms of 4 x 3 and 3 x 3 m as one plan of walls, and the doorway between them (y from 1 to 1.9)."""
    right = 4.0 + inner_m
    whole = shapely.box(-outer_m, -outer_m, right + 3.0 + outer_m, 3.0 + outer_m)
    rooms = [shapely.box(0, 0, 4, 3), shapely.box(right, 0, right + 3, 3)]
    return whole.difference(shapely.union_all(rooms)), shapely.box(4, 1, right, 1.9)


def areas(plan: FloorPlan) -> list[float]:
    return sorted(room.area for room in plan.rooms)


@pytest.mark.parametrize("side", [0.5, 0.8, 1.2])
def test_a_chimney_is_one_body_with_the_walls_and_doors_close_all_the_same(side: float) -> None:
    walls, doorway = flat()
    chimney = shapely.box(0, 0, side, side)
    plan = plan_of(in_courses(walls.union(chimney), doorway))
    assert areas(plan) == pytest.approx([9.0, 12.0 - side * side], abs=0.02)
    assert kinds(plan) == ["door"]


@pytest.mark.parametrize(("inner", "outer"), [(0.8, 0.2), (0.3, 1.0), (0.9, 0.9)])
def test_a_lintel_closes_a_door_in_a_wall_as_thick_as_a_chimney(inner: float, outer: float) -> None:
    walls, doorway = flat(inner, outer)
    plan = plan_of(in_courses(walls, doorway))
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.02)
    assert kinds(plan) == ["door"]
    assert plan.doors[0].width == pytest.approx(0.9, abs=0.02)


def test_a_slab_over_the_rooms_is_no_lintel() -> None:
    walls, doorway = flat()
    slab = trimesh.creation.box(bounds=[[-0.5, -0.5, 2.25], [7.7, 3.5, 2.4]])
    plan = plan_of([*in_courses(walls, doorway), slab])
    assert areas(plan) == pytest.approx([9.0, 12.0], abs=0.02)


def test_faces_inside_walls_of_many_courses_do_not_make_a_storey_low() -> None:
    walls, doorway = flat(0.3, 0.3)
    mesh = joined(in_courses(walls, doorway, (0.0, 0.9, 1.2, 1.4, HEAD, CEILING)))
    found = detect(mesh, Convention("z", None), Wish(), "house.ply")
    assert (found.up, found.metres) == ("z", 1.0)


@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 133])
def test_rooms_that_meet_under_a_wide_lintel_meet_in_a_turned_house_too(degrees: float) -> None:
    house = turned(joined(two_rooms(Hole(0.2, 2.9))), degrees)
    plan = plan_of(level(house))
    assert kinds(plan) == []
    assert areas(plan) == pytest.approx([9.27, 12.27], abs=0.05)
    assert plan.navigability["0.20"].components == 1


def test_no_wall_end_is_no_crash() -> None:
    """All around as thick as a chimney: nothing ends anywhere, and there is nothing to close."""
    plan = plan_of([*shell((0, 0, 4, 3), thickness=0.9), *wall((1.5, 1.2, 2.1, 1.8))])
    assert len(plan.rooms) == 1
    assert np.isclose(plan.area, 12.0 - 0.36, atol=0.02)
