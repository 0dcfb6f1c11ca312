"""Plans with furniture: what the format, the simulator and the exports make of them."""

from __future__ import annotations

import io
import json
import xml.etree.ElementTree as ET
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh
from PIL import Image

from houseexpo.analysis.audit import audit_plan
from houseexpo.analysis.navigability import disc_centre_areas, navigability
from houseexpo.dataset import open_dataset
from houseexpo.dataset.validation import validate_dataset
from houseexpo.exports import geojson, glb, irsim, ros_map, sdf, stage, svg
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.furnish import furnish_plan
from pipeline.furnish.room import has_simple_rings
from tests.builders.batch import contents, run_build
from tests.builders.mask_twins import compare_masks, comparison_mask

ROBOT_M = 0.2
HOMES = "procedural:14"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fourteen homes, half of them furnished."""
    out = tmp_path_factory.mktemp("furnished") / "built"
    run_build([HOMES], out, seed=11, plan=plan_level, furnished=0.5)
    return out


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same homes, empty."""
    out = tmp_path_factory.mktemp("plain") / "built"
    run_build([HOMES], out, seed=11, plan=plan_level)
    return out


@pytest.fixture(scope="module")
def pairs(plain: Path) -> list[tuple[FloorPlan, FloorPlan]]:
    """Plans empty and furnished."""
    plans = open_dataset(plain)
    return [(plan, furnish_plan(plan, np.random.default_rng(k))) for k, plan in enumerate(plans)]


@pytest.mark.slow
def test_a_share_of_the_houses_is_furnished_and_the_others_are_as_they_were(built: Path, plain: Path) -> None:
    plans, empty = open_dataset(built), open_dataset(plain)
    assert set(plans.ids) >= set(empty.ids)  # of two copies, one with furniture is another plan
    with_some = {plan.id for plan in plans if any(not thing.is_stairwell for thing in plan.objects)}
    assert 0.2 < len(with_some) / len(plans) < 0.8
    for plan in plans:
        if plan.id not in with_some and plan.id in empty:
            other = empty[plan.id]
            assert (plan.verts == other.verts).all()
            assert plan.doors == other.doors
    assert not validate_dataset(built).findings


def test_furniture_makes_no_room_narrower_for_the_audit(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    for empty, furnished in pairs:
        one, other = audit_plan(empty), audit_plan(furnished)
        assert one is not None
        assert other is not None
        assert [room.type for room in one.rooms] == [room.type for room in other.rooms]
        for measure in ("area_m2", "width_m", "aspect"):  # an inscribed circle is found to 0.01 m
            sizes = [[getattr(room, measure) for room in audit.rooms] for audit in (one, other)]
            assert sizes[0] == pytest.approx(sizes[1], abs=0.01)
        assert (one.overlap, one.holes, one.pieces) == (other.overlap, other.holes, other.pieces)
    assert any(furnished.objects for _, furnished in pairs)


@pytest.mark.slow
def test_furniture_is_the_same_whatever_the_workers(built: Path, tmp_path: Path) -> None:
    run_build([HOMES], tmp_path / "two", seed=11, plan=plan_level, furnished=0.5, workers=2)
    assert contents(tmp_path / "two") == contents(built)


def test_pieces_do_not_collide_with_each_other_walls_or_doors(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    assert sum(len(full.objects) for _, full in pairs) > 5 * len(pairs)
    for empty, full in pairs:
        shapes = [thing.polygon for thing in full.objects if not thing.is_stairwell]
        assert all(one.distance(other) > 0.045 for one, other in combinations(shapes, 2))
        for thing in full.objects[len(empty.objects) :]:
            room = empty.room(thing.room if thing.room is not None else -1)
            assert room.polygon.buffer(1e-6).covers(thing.polygon)
        for door in full.doors:
            before = shapely.LineString(door.segment).buffer(0.4, cap_style="flat")
            assert not any(before.intersection(shape).area > 1e-6 for shape in shapes)


def test_the_free_space_is_what_is_left(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    for empty, full in pairs:
        taken = shapely.union_all([thing.polygon for thing in full.objects])
        assert full.free_space.symmetric_difference(empty.free_space.difference(taken)).area < 1e-6
        assert full.floor.symmetric_difference(empty.floor).area < 1e-6
        assert full.bbox == empty.bbox
        assert has_simple_rings(full.free_space)
        assert full.doors == empty.doors
        assert [room.label for room in full.rooms] == [room.label for room in empty.rooms]


def test_a_robot_gets_wherever_it_got_before(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    for empty, full in pairs:
        was, now = disc_centre_areas(empty.free_space, ROBOT_M), disc_centre_areas(full.free_space, ROBOT_M)
        assert len(now) <= len(was)
        for room in empty.rooms:
            assert room.polygon.intersects(now[0]) or not room.polygon.intersects(was[0])
        if full.objects:
            assert full.navigability["0.20"] == navigability(full)["0.20"]


def test_a_furnished_house_is_a_copy_of_the_empty_one(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    empty, full = max(pairs, key=lambda pair: len(pair[1].objects))
    match = compare_masks(comparison_mask(empty), comparison_mask(full))
    assert match is not None
    assert match.difference < 1e-3


def test_a_plan_that_has_furniture_or_no_rooms_is_left_alone(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    _, full = pairs[0]
    assert furnish_plan(full, np.random.default_rng(0)) is full
    published = FloorPlan("p", [(0.1, 0.1), (0.1, 5.1), (5.1, 5.1), (5.1, 0.1)], 1, {})
    assert furnish_plan(published, np.random.default_rng(0)) is published


def test_exports_build_it_as_high_as_it_is(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    empty, full = max(pairs, key=lambda pair: len(pair[1].objects))
    world = ET.fromstring(sdf(full)[f"{full.id}.sdf"])  # noqa: S314 - our own
    models = {model.attrib["name"]: model for model in world.iter("model")}
    sizes = [box.text for box in models["furniture"].iter("size")]
    assert len(sizes) == 2 * len(full.objects)  # a collision and a visual each
    heights = sorted(float(str(text).split()[2]) for text in sizes)
    assert heights[::2] == pytest.approx(sorted(thing.height for thing in full.objects))
    scene = trimesh.load(io.BytesIO(glb(full)[f"{full.id}.glb"]), file_type="glb")
    furniture = scene.geometry["furniture"]
    assert furniture.is_watertight
    assert furniture.volume == pytest.approx(sum(t.polygon.area * t.height for t in full.objects), rel=1e-3)
    walls = scene.geometry["walls"]
    assert walls.is_watertight
    bare = trimesh.load(io.BytesIO(glb(empty)[f"{full.id}.glb"]), file_type="glb").geometry["walls"]
    assert walls.volume == pytest.approx(bare.volume, rel=1e-6)  # furniture is no wall
    drawn = svg(full)[f"{full.id}.svg"].decode()
    assert drawn.count("</title></path>") >= len(full.objects)
    kinds = [feature["properties"]["kind"] for feature in json.loads(geojson(full)[f"{full.id}.geojson"])["features"]]
    assert kinds.count("object") == len(full.objects)


def test_flat_worlds_have_it_as_obstacles_beside_whole_walls(pairs: list[tuple[FloorPlan, FloorPlan]]) -> None:
    empty, full = max(pairs, key=lambda pair: len(pair[1].objects))
    worlds = [stage(plan)[f"{full.id}.world"].decode() for plan in (empty, full)]
    assert worlds[1].count("block (") == worlds[0].count("block (") + len(full.objects)
    obstacles = [irsim(plan)[f"{full.id}.irsim.yaml"].decode().count("'polygon'") for plan in (empty, full)]
    assert obstacles[1] == obstacles[0] + len(full.objects)
    walls, bare = (shapely.union_all(plan.walls()) for plan in (full, empty))
    assert walls.symmetric_difference(bare).area < 1e-6
    maps = [np.asarray(Image.open(io.BytesIO(ros_map(plan)[f"{full.id}.pgm"]))) for plan in (empty, full)]
    taken = sum(thing.polygon.area for thing in full.objects)
    more = (maps[1] == 0).sum() - (maps[0] == 0).sum()
    assert more * 0.05**2 == pytest.approx(taken, rel=0.05)
