"""Plans are copies where walls, openings, rooms, doors and furniture are the same; variants are no copies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon, box

from houseexpo.analysis.copies import OPENING_M, SAME_WALL_M, copy_symmetry, find_duplicates, walls_and_parts
from houseexpo.analysis.kernels.walls import all_near, distances
from houseexpo.analysis.similarity import SYMMETRIES
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.parts import Door, PlanObject, Room
from tests.builders.tries import tries


def flat(
    name: str,
    *,
    wall_x: float = 4.0,
    door: float = 0.9,
    thick: float = 0.1,
    partition: bool = True,
    labels: tuple[str, str] = ("Bedroom", "Kitchen"),
    entrance: float = 1.0,
    parts: bool = True,
    bed_x: float | None = None,
    margin: float = 0.0,
) -> FloorPlan:
    """Two rooms, 9 x 7 m, with a door in the partition and an entrance in the front."""
    free = box(-margin, -margin, 9.0 + margin, 7.0 + margin)
    if partition:
        free -= box(wall_x, -1, wall_x + thick, 3.0) | box(wall_x, 3.0 + door, wall_x + thick, 8)
    objects: tuple[PlanObject, ...] = ()
    if bed_x is not None:
        bed = box(bed_x, 5.0, bed_x + 1.6, 6.5)
        free = free.difference(bed)
        objects = (PlanObject(0, "bed", 0, np.array(bed.exterior.coords)[:-1], 0.5),)
    rings = [np.array(ring.coords)[:-1] for ring in (free.exterior, *free.interiors)]
    rooms: tuple[Room, ...] = ()
    doors: tuple[Door, ...] = ()
    if parts:
        ends = (0.0, wall_x), (wall_x + thick, 9.0)
        rooms = tuple(
            Room(i, labels[i], np.array(box(x, 0, x2, 7).exterior.coords)[:-1]) for i, (x, x2) in enumerate(ends)
        )
        middle = wall_x + thick / 2
        doors = (
            Door(0, "door", ((middle, 3.0), (middle, 3.0 + door)), door, square(middle, 3.0 + door / 2), (0, 1)),
            Door(1, "entrance", ((entrance, -0.1), (entrance + 0.9, -0.1)), 0.9, square(entrance, 0), (0, None)),
        )
    return FloorPlan(name, rings[0], 2, {}, holes=tuple(rings[1:]), rooms=rooms, doors=doors, objects=objects)


def square(x: float, y: float) -> np.ndarray:
    return np.array(box(x - 0.1, y - 0.1, x + 0.1, y + 0.1).exterior.coords)[:-1]


def copies(*plans: FloorPlan) -> list[tuple[str, str]]:
    return [(found.id, found.kept_id) for found in find_duplicates(plans)]


@pytest.mark.parametrize("parts", [True, False])
def test_a_flat_and_the_hall_without_its_wall_are_two_plans(parts: bool) -> None:
    assert copies(flat("a", parts=parts), flat("b", partition=False, parts=parts)) == []


@pytest.mark.parametrize(
    "vary",
    [
        *(lambda i, p=p: flat(str(i), door=(0.8, 0.9, 1.0)[i], parts=p) for p in (True, False)),
        *(lambda i, p=p: flat(str(i), wall_x=3.0 + 0.3 * i, parts=p) for p in (True, False)),
        lambda i: flat(str(i), bed_x=0.5 + 0.4 * i),
        lambda i: flat(str(i), bed_x=(None, 1.0, 2.0)[i]),
        lambda i: flat(str(i), entrance=1.0 + 0.3 * i),
        lambda i: flat(str(i), labels=("Bedroom", ("Kitchen", "Office", "Bathroom")[i])),
    ],
)
def test_a_data_set_of_variants_keeps_all_of_them(vary: Callable[[int], FloorPlan]) -> None:
    assert copies(*map(vary, range(3))) == []


def test_a_turned_or_mirrored_house_is_a_copy_with_its_doors() -> None:
    plan = flat("a", entrance=0.5)
    turned = replace(
        plan,
        id="b",
        verts=plan.verts[:, ::-1] * [-1, 1],
        rooms=tuple(replace(room, ring=room.ring[:, ::-1] * [-1, 1]) for room in plan.rooms),
        doors=tuple(replace(door, segment=tuple((-y, x) for x, y in door.segment)) for door in plan.doors),
    )
    assert copies(plan, turned) == [("b", "a")]
    assert copies(plan, replace(turned, doors=turned.doors[:1])) == []


@tries(30)
@given(st.integers(0, 2**32 - 1))
def test_walls_within_reach_are_those_that_shapely_finds_in_a_buffer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one = shapely.union_all([box(x, y, x + w, y + h) for x, y, w, h in rng.uniform(1, 4, (4, 4))])
    other = shapely.affinity.translate(one, *rng.uniform(-0.15, 0.15, 2))
    edges = [np.concatenate([_edges(ring) for ring in _rings(shape)]) for shape in (one, other)]
    farthest = shapely.hausdorff_distance(shapely.segmentize(one.boundary, 0.01), other.boundary)
    points = shapely.get_coordinates(shapely.segmentize(one.boundary, 0.05))
    expected = shapely.distance(shapely.points(points), other.boundary)
    np.testing.assert_allclose(distances(points, edges[1]), expected, atol=1e-9)
    for limit in (farthest * 0.6, expected.max() + 1e-6, farthest * 1.3):
        if abs(expected.max() - limit) > 0.03 or limit > farthest:
            near = all(shapely.distance(s, other.boundary) <= limit for s in shapely.points(points))
            assert all_near(edges[0], edges[1], limit, 0.05) is near


def _rings(shape: Polygon) -> list[np.ndarray]:
    return [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(shape))]


def _edges(ring: np.ndarray) -> np.ndarray:
    return np.column_stack([ring, np.roll(ring, -1, axis=0)])


@tries(25)
@given(st.sampled_from(list(SYMMETRIES)), st.floats(-50, 50), st.floats(-50, 50))
def test_being_a_copy_does_not_depend_on_place_or_direction(symmetry: str, x: float, y: float) -> None:
    swap, flip_y, flip_x = SYMMETRIES[symmetry]
    plan = flat("a", parts=False)
    verts = (plan.verts[:, ::-1] if swap else plan.verts) * (-1 if flip_x else 1, -1 if flip_y else 1)
    moved = walls_and_parts(replace(plan, verts=verts + np.array([x, y])))
    assert copy_symmetry(walls_and_parts(plan), moved)
    assert copy_symmetry(moved, walls_and_parts(plan))
    for other in (
        flat("b", door=0.9 + OPENING_M + 0.02, parts=False),
        flat("b", wall_x=4.0 + 2 * SAME_WALL_M, parts=False),
    ):
        assert copy_symmetry(walls_and_parts(other), moved) is None


@pytest.mark.parametrize("wrong", [{"threshold": -1.0}, {"threshold": float("nan")}, {"threads": 0}])
def test_a_threshold_that_is_no_share_and_no_threads_are_refused(wrong: dict[str, float]) -> None:
    (name,) = wrong
    with pytest.raises(ConfigError, match=f"{name}: expected"):
        find_duplicates([flat("a"), flat("b")], **wrong)


@pytest.mark.parametrize("radius", [-1.0, float("nan"), float("inf")])
def test_a_path_of_a_robot_without_a_size_is_refused(radius: float) -> None:
    with pytest.raises(ConfigError, match="radius: expected 0 or more metres"):
        flat("a").shortest_path((1, 1), (2, 2), radius)
