"""The kit of kinds: its truth agrees with its geometry, a seed gives the same bytes, and formats are read as made."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import trimesh

from tests.builders.kinds.homes import Style, random_storeys
from tests.builders.kinds.measuring import measure
from tests.builders.kinds.office import random_office
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.kinds.rowhouses import random_row
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


@needs_shared
@pytest.mark.parametrize("kind", EXACT)
def test_what_a_source_says_is_what_the_plan_holds(kind, tmp_path):
    outcome = measure(kind, 0, 1, str(tmp_path))
    assert outcome.met, outcome.failing
    assert all(score["width_error_m"] <= 0.05 for score in outcome.scores)
    assert kind == "raw_sdf" or all(score["label_accuracy"] >= 0.95 for score in outcome.scores)


# What a survey does to the points of a made home.
