"""Algorithm 1 from a level to its plan: tiny houses whose plan can be written down."""

import numpy as np
import pytest
import shapely

from houseexpo.floorplan import decode
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_largest_building
from pipeline.config import EvidenceConfig, LayoutConfig, PipelineConfig
from pipeline.rejection import Reason, Rejection
from pipeline.values import Mesh, SourceObject, SourceRoom
from tests.builders.houses import (
    Hole,
    Parts,
    difference,
    gap,
    kinds,
    level,
    plan_of,
    sheet_wall,
    shell,
    stage_values,
    two_rooms,
    wall,
    window,
)
from tests.builders.meshes import box, joined, sheet, turned

LEFT, RIGHT = shapely.box(0.1, 0.1, 4.1, 3.1), shapely.box(4.3, 0.1, 7.3, 3.1)
TWO_ROOMS = shapely.union_all([LEFT, RIGHT, shapely.box(4.1, 1.1, 4.3, 2.0)])
DOOR = Hole(1.0, 1.9)


def test_two_rooms_and_a_door_come_out_to_the_centimetre() -> None:
    plan = plan_of(two_rooms(DOOR))
    assert plan.free_space.equals(TWO_ROOMS)
    assert [room.polygon.area for room in plan.rooms] == pytest.approx([12.0, 9.0])
    (door,) = plan.doors
    assert (door.kind, door.width) == ("door", 0.9)
    assert sorted(door.segment) == [(4.2, 1.1), (4.2, 2.0)]
    assert plan.room_num == 2
    assert plan.navigability["0.20"].components == 1
    assert plan.navigability["0.20"].narrowest == pytest.approx(0.9, abs=0.02)


def test_the_stages_come_in_the_papers_order() -> None:
    assert list(stage_values(two_rooms(DOOR))) == [
        "evidence", "planes", "layout", "doors", "contour", "cells", "isolated", "connectivity", "refine", "plan",
    ]  # fmt: skip


def test_the_heights_used_and_what_the_rules_did_are_recorded() -> None:
    provenance = plan_of(level(two_rooms(), provenance={"source": "mesh"})).provenance
    assert provenance["source"] == "mesh"
    assert provenance["heights"]["sill"] == 0.45
    assert provenance["heights"]["breast"] == 1.1
    assert provenance["notes"] == {"cuts": 1, "doors_unknown": 1}


def test_sills_give_the_same_plan_as_lintels() -> None:
    with_sills = [*shell((0, 0, 7.2, 3)), *wall((4, 0, 4.2, 3), Hole(1.0, 1.9, 0.04, 2.1))]
    plan = plan_of(level(with_sills, sills=True))
    assert plan.free_space.equals(TWO_ROOMS)
    assert kinds(plan) == ["door"]


def sheets() -> Parts:
    corners = [(0.0, 0.0), (7.2, 0.0), (7.2, 3.0), (0.0, 3.0)]
    holes = [[window(1, 2), Hole(5, 6)], [], [window(2, 3)], []]
    outer = [
        part for a, b, h in zip(corners, corners[1:] + corners[:1], holes, strict=True) for part in sheet_wall(a, b, *h)
    ]
    return [*outer, *sheet_wall((4.1, 0.0), (4.1, 3.0), DOOR)]


def test_a_house_of_sheets_with_windows() -> None:
    plan = plan_of(sheets())
    rooms = [shapely.box(0.1, 0.1, 4.15, 3.05), shapely.box(4.2, 0.1, 7.25, 3.05)]
    assert difference(plan.free_space, shapely.union_all([*rooms, shapely.box(4.15, 1.07, 4.2, 1.98)])) < 0.005
    assert kinds(plan) == ["door", "entrance"]
    assert {d.width for d in plan.doors} == {0.9, 1.0}


@pytest.mark.parametrize("outwards", [True, False])
def test_a_room_of_sheets_is_a_room_whichever_way_its_faces_look(outwards: bool) -> None:
    corners = [(0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0)]
    order = corners if outwards else corners[::-1]
    parts = [sheet(a, b, 0.0, 2.5) for a, b in zip(order, order[1:] + order[:1], strict=True)]
    assert plan_of(parts).area == pytest.approx(4.95 * 3.95, abs=0.03)


def test_solids_and_sheets_together() -> None:
    plan = plan_of([*shell((0, 0, 7.2, 3)), *sheet_wall((4.1, 0.0), (4.1, 3.0), DOOR)])
    assert sorted(r.area for r in plan.rooms) == pytest.approx([9.225, 12.225], abs=0.02)
    assert kinds(plan) == ["door"]


def soup(parts: Parts) -> Mesh:
    mesh = joined(parts)
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def inverted(parts: Parts) -> Mesh:
    mesh = joined(parts)
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def cracked(parts: Parts) -> Mesh:
    """Every box a millimetre smaller all round."""
    shrunk = [box((*p.bounds[0, :2] + 5e-4, *p.bounds[1, :2] - 5e-4), *p.bounds[:, 2]) for p in parts]
    return joined(shrunk)


@pytest.mark.parametrize("spoil", [soup, inverted, cracked])
def test_what_modellers_do_to_a_house_changes_nothing(spoil: object) -> None:
    plan = plan_of(level(spoil(two_rooms(DOOR))))
    assert difference(plan.free_space, TWO_ROOMS) < 0.003
    assert kinds(plan) == ["door"]


def test_a_wall_of_a_centimetre_parts_two_rooms() -> None:
    plan = plan_of(two_rooms(DOOR, thickness=0.01))
    assert len(plan.rooms) == 2
    assert kinds(plan) == ["door"]
    assert plan.area == pytest.approx(21.0, abs=0.25)


def test_a_ceiling_a_floor_slab_and_a_wall_cabinet_change_nothing() -> None:
    slabs = [box((-0.2, -0.2, 7.4, 3.2), 2.5, 2.7), box((-0.2, -0.2, 7.4, 3.2), -0.3, 0.0)]
    cabinet = box((0.0, 0.5, 0.35, 2.5), 1.4, 2.1)
    plan = plan_of(level([*two_rooms(DOOR), *slabs, cabinet], ceiling_m=2.7))
    assert plan.free_space.equals(TWO_ROOMS)


def test_furniture_is_in_the_plan_only_where_it_was_asked_for() -> None:
    table, cupboard = box((1.0, 1.0, 2.0, 2.0), 0.0, 0.75), box((0.0, 2.4, 1.0, 3.0), 0.0, 1.6)
    lamp = SourceObject(("Lamp",), joined([box((2.5, 1.0, 3.0, 1.5), 1.8, 2.2)]))
    house = level([*two_rooms(DOOR), cupboard], furniture=(SourceObject(("Table",), joined([table])), lamp))
    assert plan_of(house).free_space.equals(TWO_ROOMS)
    assert plan_of(house).objects == ()
    plan = plan_of(house, PipelineConfig(evidence=EvidenceConfig(furniture=True)))
    assert plan.area == pytest.approx(TWO_ROOMS.area - 1.0 - 0.6, abs=0.01)
    assert len(plan.holes) == 1
    assert [(each.label, each.height, each.room) for each in plan.objects] == [("Table", 0.75, 0), ("object", 1.6, 0)]
    assert plan.navigability["0.20"].components == 1


def test_a_chimney_is_filled_and_a_free_standing_block_is_a_hole() -> None:
    plan = plan_of([*shell((0, 0, 6, 5)), *shell((2.1, 2.1, 2.9, 2.9), 0.1)])
    assert len(plan.holes) == 1
    assert plan.area == pytest.approx(29.0)
    assert plan.provenance["notes"] == {"filled_cells": 1}


def test_a_balcony_is_a_room_with_a_door() -> None:
    parapet = [
        *wall((-0.2, -1.8, 0, -0.2), top=1.0),
        *wall((4, -1.8, 4.2, -0.2), top=1.0),
        *wall((-0.2, -2, 4.2, -1.8), top=1.0),
    ]
    plan = plan_of([*shell((0, 0, 4, 3), front=[DOOR]), *parapet])
    assert sorted(round(r.area, 2) for r in plan.rooms) == [6.4, 12.0]
    assert kinds(plan) == ["door"]


@pytest.mark.parametrize(("width", "expected"), [(1.2, ["opening"]), (1.6, ["opening"]), (2.1, [])])
def test_gaps_of_full_height(width: float, expected: list[str]) -> None:
    plan = plan_of(two_rooms(gap(0.7, 0.7 + width)))
    assert kinds(plan) == expected
    assert len(plan.rooms) == 1 + len(expected)
    assert plan.area == pytest.approx(21 + 0.2 * width, abs=0.01)


def test_an_oblique_wall_keeps_its_angle() -> None:
    slanted = turned(joined([box((-3.0, -0.1, 8.0, 0.1), 0.0, 2.5)]), 45.0, (2.0, 0.0, 0.0))
    mesh = joined(shell((0, 0, 6, 4)))
    both = Mesh(
        np.concatenate([mesh.vertices, slanted.vertices]),
        np.concatenate([mesh.faces, slanted.faces + len(mesh.vertices)]),
    )
    plan = plan_of(level(both))
    assert len(plan.rooms) == 2
    assert kinds(plan) == ["cut"]
    edges = np.roll(plan.verts, -1, axis=0) - plan.verts
    angles = np.degrees(np.arctan2(edges[:, 1], edges[:, 0])) % 90
    assert set(np.round(angles).astype(int).tolist()) <= {0, 45, 90}


def test_a_round_tower() -> None:
    import trimesh

    tower = trimesh.creation.annulus(r_min=2.0, r_max=2.2, height=2.5, sections=48)
    tower.apply_translation((0, 0, 1.25))
    plan = plan_of([tower])
    assert plan.area == pytest.approx(np.pi * 4, rel=0.02)


def test_labels_reach_the_plan() -> None:
    rooms = (
        SourceRoom(("Küche",), ("Kitchen",), box=(4.1, -0.1, 7.3, 3.1)),
        SourceRoom(("Zimmer 1",), (), box=(0, 0, 4, 3)),
    )
    plan = plan_of(level(two_rooms(DOOR), rooms=rooms, room_count=2))
    assert sorted((r.label, r.source_labels) for r in plan.rooms) == [
        ("Kitchen", ("Küche",)),
        ("Unlabelled", ("Zimmer 1",)),
    ]
    assert list(plan.room_category) == ["Kitchen"]


def test_the_same_seed_gives_the_same_bytes() -> None:
    first, second = (encode(plan_of(two_rooms(), seed=4)) for _ in range(2))
    assert first == second
    assert encode(decode(first)) == first


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ([], Reason.NO_LAYOUT),
        (wall((0, 0, 5, 0.2)), Reason.NOT_ENCLOSED),
        (shell((0, 0, 12, 0.3)), Reason.NO_ROOM_FITS),
    ],
    ids=["nothing", "one wall", "a slit of 0.3 m"],
)
def test_what_is_no_house_is_rejected_with_its_reason(parts: Parts, reason: Reason) -> None:
    with pytest.raises(Rejection) as caught:
        plan_of(level(parts or Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))))
    assert caught.value.reason == reason
    assert caught.value.detail


def test_the_configuration_reaches_every_stage() -> None:
    config = PipelineConfig(layout=LayoutConfig(area_m2=50.0))
    with pytest.raises(Rejection, match=r"expected at least 50 m²"):
        plan_largest_building(level(two_rooms(DOOR)), config, np.random.default_rng(0))
