"""How doubtful it is that a space is a room of the house: terraces, slabs and boxes against rooms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from houseexpo.grids.frame import source_points_from_plan
from pipeline.config import EvidenceConfig, LayoutConfig, PlanesConfig
from pipeline.geometry.meshes import Mesh
from pipeline.geometry.prisms import Prism, Prisms
from pipeline.stages.evidence import gather_evidence
from pipeline.stages.layout import close_openings
from pipeline.stages.planes import find_planes
from pipeline.stages.room_doubt import (
    _under_cover,
    closed_cells,
    doubt_spaces,
    of_rooms,
    space_features,
    unlikely_rooms,
)
from pipeline.values import Evidence, Layout, Level, Opening, SourceRoom
from tests.builders.houses import Hole, Parts, gap, kinds, level, plan_of, shell, two_rooms, wall, window
from tests.builders.meshes import box
from tests.builders.tries import tries


def found(parts: Parts | Mesh, **values: object) -> tuple[Level, Evidence, Layout]:
    house = level(parts, **values)
    evidence = gather_evidence(house, EvidenceConfig())
    planes = find_planes(house, evidence, PlanesConfig())
    return house, evidence, close_openings(house, evidence, planes, LayoutConfig())


def test_rooms_with_a_door_between_them_are_not_doubted() -> None:
    house, evidence, layout = found(two_rooms(Hole(1.0, 1.9)))
    assert doubt_spaces(house, evidence, layout).max() < 0.1


def test_a_terrace_is_more_doubtful_than_the_room_behind_it() -> None:
    """A room of 4 x 3 m under a roof, and a terrace of 1.6 m before it, open to the sky, with a parapet of 1 m."""
    parapet = [box(r, 0, 1.0) for r in ((-0.2, -2.0, 4.2, -1.8), (-0.2, -1.8, 0.0, -0.2), (4.0, -1.8, 4.2, -0.2))]
    roof = box((-0.2, -0.2, 4.2, 3.2), 2.5, 2.7)
    house, evidence, layout = found([*shell((0, 0, 4, 3), front=[Hole(1, 1.9)]), *parapet, roof])
    doubts = doubt_spaces(house, evidence, layout)
    room, terrace = of_rooms(layout, doubts, [shapely.box(1, 1, 2, 2), shapely.box(1, -1.2, 2, -0.8)])
    assert terrace > room
    assert room < 0.1


def test_spaces_keep_what_the_rules_took_away() -> None:
    """Without a floor, and with nothing that leads into it: the rules take it away, and its features say why."""
    house = [*shell((0, 0, 4, 3)), *shell((6, 0, 9, 3))]
    _, _, layout = found(house, floor=shapely.box(-0.2, -0.2, 4.2, 3.2), below=shapely.box(6, 0, 9, 3))
    assert (len(layout.spaces), len(layout.rooms)) == (2, 1)
    features = space_features(*found(house, floor=shapely.box(-0.2, -0.2, 4.2, 3.2), below=shapely.box(6, 0, 9, 3)))
    places = [shapely.box(7, 1, 8, 2), shapely.box(1, 1, 2, 2)]
    assert of_rooms(layout, features["over_void"], places) == pytest.approx([1.0, 0.0], abs=0.01)
    assert of_rooms(layout, features["floorless"], places) == pytest.approx([1.0, 0.0], abs=0.01)


@pytest.mark.parametrize("parts", [two_rooms(gap(1.0, 1.9)), [*shell((0, 0, 4, 3)), *wall((4.2, 1, 8, 1.2))]])
def test_features_are_shares(parts: Parts) -> None:
    for name, values in space_features(*found(parts)).items():
        assert np.all((values >= 0) & (values <= 1 + 1e-9)), name


def test_drawings_and_sources_that_mark_their_doors_are_not_doubted() -> None:
    house, evidence, layout = found(two_rooms(Hole(1.0, 1.9)), sills=True)
    assert doubt_spaces(house, evidence, layout).tolist() == [0.0] * len(layout.spaces)


SHAFT = (6.2, 0.0, 7.2, 2.2)
WITH_SHAFT = [*two_rooms(Hole(1.0, 1.9)), *wall((6.1, 2.2, 7.2, 2.3)), *wall((6.1, 0.0, 6.2, 2.2))]


def test_a_shaft_is_likely_no_room() -> None:
    house, evidence, layout = found(WITH_SHAFT)
    doubts = doubt_spaces(house, evidence, layout)
    assert unlikely_rooms(house, evidence, layout, doubts).bounds == pytest.approx(SHAFT, abs=1e-3)
    assert unlikely_rooms(house, evidence, layout, 0.0 * doubts).is_empty


def test_a_space_that_the_source_names_or_furnishes_is_a_room_however_doubtful() -> None:
    house, evidence, layout = found(WITH_SHAFT)
    doubts, place = doubt_spaces(house, evidence, layout), shapely.box(*SHAFT)
    named = replace(house, rooms=(SourceRoom((), ("Closet",), place),))
    assert unlikely_rooms(named, evidence, layout, doubts).is_empty
    floored = replace(evidence, floor=shapely.box(-0.2, -0.2, 7.4, 3.2))
    assert not unlikely_rooms(house, floored, layout, doubts).is_empty
    lived_in = replace(floored, furniture=shapely.box(6.3, 0.1, 6.6, 0.4))
    assert unlikely_rooms(house, lived_in, layout, doubts).is_empty


def test_little_doubt_is_enough_for_a_tiny_space_only() -> None:
    house, evidence, layout = found(WITH_SHAFT)
    area = [unlikely_rooms(house, evidence, layout, np.full(3, doubt)).area for doubt in (0.1, 0.2, 0.4)]
    assert area == pytest.approx([0.0, 2.2, 12.0 + 6.47 + 2.2], abs=0.01)


def test_a_house_leaves_out_its_shaft_and_says_so() -> None:
    plan = plan_of(WITH_SHAFT)
    assert [round(room.area, 2) for room in plan.rooms] == [12.0, 6.47]
    assert kinds(plan) == ["door"]
    (told,) = plan.provenance["closed_spaces"]
    assert told["area"] == pytest.approx(2.2, abs=0.01)
    assert shapely.box(*SHAFT).contains(shapely.points(source_points_from_plan(plan.frame, [told["place"]]))).all()


CELL = (8.2, 0.0, 10.2, 2.0)


def with_cell(between: Hole, *windows: Hole) -> Parts:
    """Two rooms of 12 and 12 m2, and beside them a cell of 4 m2 into which nothing leads."""
    rooms = [*shell((0.0, 0.0, 8.0, 3.0)), *wall((4.0, 0.0, 4.2, 3.0), between)]
    x1, _, x2, top = CELL
    cell = [wall((x1, -0.2, x2, 0.0), *windows), wall((x1, top, x2, top + 0.2)), wall((x2, -0.2, x2 + 0.2, top + 0.2))]
    return [*rooms, *(part for each in cell for part in each)]


@pytest.mark.parametrize(
    ("way", "expected"), [(gap(1.0, 1.9), ["opening"]), (Hole(1.0, 1.9), ["cut", "door"])], ids=["gap", "door"]
)
def test_a_cell_is_none_where_others_have_ways_and_no_doors(way: Hole, expected: list[str]) -> None:
    assert closed_cells(*found(with_cell(way))).bounds == pytest.approx(CELL, abs=1e-3)
    plan = plan_of(with_cell(way))
    assert kinds(plan) == expected
    assert len(plan.rooms) + len(plan.provenance.get("closed_spaces", ())) == 3


@pytest.mark.parametrize(
    "parts",
    [
        with_cell(Hole(1.0, 1.9), window(9.0, 9.8)),
        [*with_cell(Hole(1.0, 1.9)), box((8.5, 0.5, 9.2, 1.2), 0.0, 0.7)],
        with_cell(Hole(1.0, 1.0)),  # it is not known where the ways of any room are
        two_rooms(),
        [*two_rooms(Hole(1.0, 1.9)), *shell((7.4, 0.0, 11.4, 3.0))],  # a large part of the storey
    ],
    ids=["window", "furniture", "no ways", "two rooms", "large"],
)
def test_a_closed_space_may_be_a_room(parts: Parts) -> None:
    assert closed_cells(*found(parts)).is_empty


def test_a_source_that_names_its_walls_or_rooms_has_no_cells() -> None:
    house, evidence, layout = found(with_cell(gap(1.0, 1.9)))
    assert closed_cells(replace(house, only_walls=True), evidence, layout).is_empty
    named = replace(house, rooms=(SourceRoom((), ("Closet",), shapely.box(*CELL)),))
    assert closed_cells(named, evidence, layout).is_empty


@tries(30)
@given(st.integers(0, 10_000), st.integers(1, 12))
def test_what_lies_over_a_place_is_found_as_by_looking_at_each_triangle(seed: int, count: int) -> None:
    """The slow twin: each triangle by itself, with Shapely."""
    rng = np.random.default_rng(seed)
    corners = np.concatenate([rng.uniform(-1, 5, (count * 3, 2)), rng.uniform(0, 4, (count * 3, 1))], axis=1)
    space = shapely.box(0, 0, 4, 3)
    mesh = Mesh(corners, np.arange(count * 3).reshape(-1, 3))
    house = level([box((0, 0, 1, 1), 0, 2)], cover=None)
    shares = _under_cover([space], replace(house, walls=mesh))
    assert shares is not None
    step = 4 / 8
    places = [(x, y) for x in np.arange(step / 2, 4, step) for y in np.arange(step / 2, 3, step)]
    over = [any(_is_over(corners[3 * k : 3 * k + 3], place) for k in range(count)) for place in places]
    assert shares[0] == pytest.approx(np.mean(over), abs=1e-9)


def _is_over(triangle: np.ndarray, place: tuple[float, float]) -> bool:
    flat = Polygon(triangle[:, :2])
    if flat.area <= 1e-3 or not flat.intersects(shapely.Point(place)):
        return False
    a, b, c = triangle
    height = a[2] + np.linalg.solve(np.array([b[:2] - a[:2], c[:2] - a[:2]]).T, np.subtract(place, a[:2])) @ [
        b[2] - a[2],
        c[2] - a[2],
    ]
    return bool(height > 1.8)


@pytest.mark.parametrize(
    ("has_door", "rooms", "expected"),
    [(True, (), True), (False, (), False), (True, (SourceRoom((), (), shapely.box(*CELL)),), False)],
    ids=["doors", "gaps", "rooms"],
)
def test_a_drawing_of_walls_and_doors_has_no_room_without_a_door(
    has_door: bool, rooms: tuple[SourceRoom, ...], expected: bool
) -> None:
    walls = Prisms([Prism(shapely.box(*p.bounds[0][:2], *p.bounds[1][:2]), 0.0, 2.5) for p in with_cell(gap(1.0, 1.9))])
    door = Opening.named(shapely.box(4.0, 1.0, 4.2, 1.9), has_door=has_door)
    house, evidence, layout = found(walls, openings=(door,), only_walls=True, rooms=rooms)
    area = unlikely_rooms(house, evidence, layout, np.zeros(len(layout.spaces)))
    assert area.is_empty if not expected else area.bounds == pytest.approx(CELL, abs=1e-3)
