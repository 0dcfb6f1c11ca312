"""The kit of kinds: its truth agrees with its geometry, a seed gives the same bytes, and formats are read as made."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh

from tests.builders.kinds.cloud import AGAIN_M, OUTSIDE_M, _seen, _seen_again, _through_glass
from tests.builders.kinds.homes import Style, random_home, random_storeys
from tests.builders.kinds.measuring import measure
from tests.builders.kinds.office import random_office
from tests.builders.kinds.placing import Placing, truth_of
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.kinds.rowhouses import random_row
from tests.builders.kinds.values import LEADS_IN, OUTSIDE
from tests.builders.shared import needs_shared

EXACT = [kind for kind in RAW if kind.startswith("raw_")]
"""Homes in the formats of docs/sources.md."""
HEAVY = {"scan5", "scan20", "office", "artist_unnamed", "scale_models"}


def each(kinds):
    """Kinds as parameters; those with many triangles are slow."""
    return [pytest.param(kind, marks=pytest.mark.slow if kind in HEAVY else ()) for kind in kinds]


def storeys():
    """Storeys of all sizes of layout."""
    for seed in range(8):
        for size in ("home", "small", "row"):
            yield random_storeys(np.random.default_rng(seed), Style(size=size), 1)[0]
    yield from random_storeys(np.random.default_rng(1), Style(), 3)
    yield random_row(np.random.default_rng(2))
    yield random_office(np.random.default_rng(3))


@pytest.fixture(scope="module")
def made():
    """Some storeys of each sort."""
    return list(storeys())


def clearance(points, walls):
    """How far each point lies from the nearest wall's body; by hand, without the shapes that the kit is built with."""
    a, b = (np.array([getattr(w, end) for w in walls]) for end in ("a", "b"))
    way = b - a
    s = np.einsum("pwk,wk->pw", points[:, None] - a, way) / (way**2).sum(axis=1)
    nearest = a + np.clip(s, 0.0, 1.0)[..., None] * way
    apart = np.hypot(*np.moveaxis(points[:, None] - nearest, -1, 0))
    return (apart - np.array([w.thickness for w in walls]) / 2).min(axis=1)


@pytest.mark.slow
def test_rooms_are_where_no_wall_is(made):
    for storey in made:
        for room in storey.rooms:
            assert room.is_valid
            assert room.area > 0.7
            assert clearance(np.asarray(room.exterior.coords), storey.walls).min() > -1e-6
        whole = shapely.union_all(storey.rooms)
        assert whole.area == pytest.approx(sum(r.area for r in storey.rooms), abs=1e-6)


@pytest.mark.slow
def test_each_opening_goes_through_its_wall_from_one_side_to_the_other(made):
    for storey in made:
        for opening in storey.openings:
            wall = storey.walls[opening.wall]
            assert 0 < opening.start < opening.end < wall.length
            assert opening.sill < opening.head <= storey.height
            for side, cell in zip((1, -1), wall.sides, strict=True):
                point = shapely.Point(wall.at(opening.centre, side * (wall.thickness / 2 + 0.03)))
                inside = [k for k, room in enumerate(storey.rooms) if room.buffer(0.02).contains(point)]
                assert inside == ([] if cell == OUTSIDE else [cell])
            assert (OUTSIDE in wall.sides) == (opening.kind not in LEADS_IN)


@pytest.mark.slow
def test_one_can_walk_through_every_unit_but_from_none_to_another(made):
    for storey in made:
        doors = [storey.gap(o, 0.01) for o in storey.openings if o.kind in LEADS_IN]
        free = shapely.union_all([r.buffer(0.005) for r in storey.rooms] + doors)
        assert len(shapely.get_parts(free)) == len({c.unit for c in storey.cells})


@pytest.mark.slow
def test_nobody_steps_into_a_stairs_void():
    for seed in range(6):
        for storey in random_storeys(np.random.default_rng(seed), Style(), 2):
            voids = {k for k, cell in enumerate(storey.cells) if not cell.floor}
            assert not any(voids & set(storey.walls[o.wall].sides) for o in storey.openings if o.kind in LEADS_IN)


@pytest.mark.parametrize("kind", [*(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS), *EXACT])
def test_a_seed_gives_the_same_bytes_and_another_others(kind, tmp_path):
    first, again = (make_member(kind, 1, 5, tmp_path / name) for name in ("a", "b"))
    other = make_member(kind, 1, 6, tmp_path / "c")
    assert first.path.read_bytes() == again.path.read_bytes()
    assert first.truths == again.truths
    assert first.truths != other.truths


def sections(member, height_m):
    """The segments of a file's triangles at a height above each storey's floor, on the plan axes of the truth."""
    whole = trimesh.load_scene(member.path, process=False, skip_materials=True).to_mesh()
    x, y, z = np.asarray(whole.vertices).T * member.unit_m
    whole = trimesh.Trimesh(np.column_stack([x, z, y] if member.up == "y" else [x, y, z]), whole.faces, process=False)
    for truth in member.truths:
        origin = [0.0, 0.0, truth["floor_z"] + height_m]
        lines = trimesh.intersections.mesh_plane(whole, plane_normal=[0, 0, 1], plane_origin=origin)
        yield truth, shapely.MultiLineString([line[:, :2] for line in lines])


@pytest.mark.parametrize("kind", each(k for k in KINDS if k not in {"ifc", "scan5", "scan20"}))
@pytest.mark.slow
def test_walls_of_the_file_stand_at_the_edges_of_the_true_rooms(kind, tmp_path):
    member = make_member(kind, 2, 7, tmp_path)
    for truth, lines in sections(member, 0.63):
        doors = [shapely.Point(d["centre"]).buffer(d["width"] / 2 + d["thickness"]) for d in truth["doors"]]
        rooms = [shapely.Polygon(r["polygon"]) for r in truth["rooms"] if r["label"] != "Stair"]  # its void is open
        open_edges = shapely.union_all(doors + [r.buffer(1e-3) for r in between(rooms)])
        near = shapely.prepared.prep(lines.buffer(0.011))
        for room in rooms:
            edge = room.exterior.difference(open_edges)
            places = [edge.interpolate(s) for s in np.arange(0.0, edge.length, 0.2)]
            assert sum(near.contains(p) for p in places) >= 0.9 * len(places)


def between(rooms):
    """The lines along which rooms meet without a wall."""
    for k, room in enumerate(rooms):
        for other in rooms[:k]:
            yield room.buffer(2e-3).intersection(other.buffer(2e-3))


@pytest.mark.parametrize("kind", each(["front3d", "procthor", "gazebo", "scan5"]))
@pytest.mark.slow
def test_nothing_stands_in_the_doorways(kind, tmp_path):
    member = make_member(kind, 3, 7, tmp_path)
    for truth, lines in sections(member, 1.3):
        for door in truth["doors"]:
            if door["interior"]:
                assert lines.distance(shapely.Point(door["centre"])) > 0.2


@pytest.mark.slow
def test_a_house_on_another_axis_in_another_unit_has_its_truth_in_metres_on_that_plan(made):
    z_up = truth_of(made[0], Placing(), "solid", "house")
    y_up = truth_of(made[0], Placing(up="y", unit_m=0.01), "solid", "house")
    mirrored = np.array(z_up["rooms"][0]["polygon"]) * (1, -1)
    assert np.allclose(y_up["rooms"][0]["polygon"], mirrored)
    assert np.allclose(Placing(up="y", unit_m=0.01).in_file([[1.0, 2.0, 3.0]]), [[100.0, 300.0, -200.0]])


@needs_shared
@pytest.mark.parametrize("kind", EXACT)
def test_what_a_source_says_is_what_the_plan_holds(kind, tmp_path):
    outcome = measure(kind, 0, 1, str(tmp_path))
    assert outcome.met, outcome.failing
    assert all(score["width_error_m"] <= 0.05 for score in outcome.scores)
    assert kind == "raw_sdf" or all(score["label_accuracy"] >= 0.95 for score in outcome.scores)


# What a survey does to the points of a made home.


@pytest.fixture(scope="module")
def surveyed():
    rng = np.random.default_rng(3)
    storey = random_home(rng, Style(size="small", windows=1.0))
    return storey, _seen(storey, rng)


def test_a_side_is_seen_again_five_to_fifteen_centimetres_off(surveyed):
    storey, points = surveyed
    again = _seen_again(points, storey, np.random.default_rng(0))
    assert len(again) > 1000
    sides = shapely.MultiLineString([room.exterior for room in storey.rooms])
    away = shapely.distance(sides, shapely.points(again[:, 0], again[:, 1]))
    assert np.median(away) > AGAIN_M[0] / 2
    assert np.quantile(away, 0.95) < AGAIN_M[1] + 0.05


def test_through_clear_glass_the_ground_outside_is_seen(surveyed):
    storey, points = surveyed
    seen = _through_glass(points, storey, np.random.default_rng(0))
    house = shapely.union_all([*storey.rooms, storey.wall_area])
    beyond = seen[shapely.distance(house, shapely.points(seen[:, 0], seen[:, 1])) > 0.1]
    assert len(beyond) > 100
    assert np.abs(beyond[:, 2]).max() <= 0.3
    assert shapely.distance(house, shapely.MultiPoint(beyond[:, :2])) < OUTSIDE_M
