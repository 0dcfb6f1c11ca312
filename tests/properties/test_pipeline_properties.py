"""What must hold for every house: turned, mirrored, moved, or written down by another modeller, it is the same plan."""

from __future__ import annotations

from dataclasses import dataclass, replace

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.affinity import affine_transform

from houseexpo.analysis.graph import rooms_graph
from houseexpo.analysis.navigability import disc_centre_areas
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan.json_codec import encode
from pipeline.values import Mesh
from tests.builders.houses import HEAD, Hole, Parts, difference, level, plan_of, shell, wall
from tests.builders.meshes import box, joined, turned
from tests.builders.tries import tries


@dataclass(frozen=True)
class House:
    """Rooms in two rows along a corridor, each with a door to it; one may have none."""

    widths: tuple[tuple[float, ...], ...]
    depth: float
    corridor: float
    thickness: float
    door: float
    closed: int

    @property
    def length(self) -> float:
        """Inner length of both rows: that of the longer one."""
        return max(sum(row) + self.thickness * (len(row) - 1) for row in self.widths)

    def parts(self) -> Parts:
        """Boxes of all walls."""
        t = self.thickness
        parts = shell((0.0, 0.0, self.length, 2 * self.depth + 2 * t + self.corridor), t)
        for k, row in enumerate(self.widths):
            y, foot = (
                (self.depth, 0.0) if k == 0 else (self.depth + t + self.corridor, self.depth + 2 * t + self.corridor)
            )
            holes = []
            for j, (start, end) in enumerate(self._spans(row)):
                if k * len(self.widths[0]) + j != self.closed:
                    middle = (start + end) / 2
                    holes.append(Hole(middle - self.door / 2, middle + self.door / 2, 0.0, HEAD))
                if j < len(row) - 1:
                    parts += wall((end, foot, end + t, foot + self.depth))
            parts += wall((0.0, y, self.length, y + t), *holes)
        return parts

    def areas(self) -> list[float]:
        """Square metres of all rooms, sorted."""
        spans = [span for row in self.widths for span in self._spans(row)]
        return sorted([self.length * self.corridor, *((end - start) * self.depth for start, end in spans)])

    def _spans(self, row: tuple[float, ...]) -> list[tuple[float, float]]:
        """Where each room of a row starts and ends along x; the last one reaches to the end of the house."""
        starts = [sum(row[:j]) + self.thickness * j for j in range(len(row))]
        ends = [start + width for start, width in zip(starts, row, strict=True)]
        return list(zip(starts, [*ends[:-1], self.length], strict=True))


rows = st.lists(st.integers(240, 460).map(lambda k: k / 100), min_size=1, max_size=3).map(tuple)
houses = st.builds(
    House,
    widths=st.tuples(rows, rows),
    depth=st.integers(250, 420).map(lambda k: k / 100),
    corridor=st.integers(100, 180).map(lambda k: k / 100),
    thickness=st.sampled_from([0.06, 0.1, 0.2, 0.35]),
    door=st.sampled_from([0.7, 0.85, 1.0]),
    closed=st.integers(-1, 5),
)
quick = tries(12, derandomize=True)


def sound(plan: FloorPlan) -> None:
    """The plan is valid, tiles, in one piece for the robot, and JSON keeps it."""
    rings = [plan.verts, *plan.holes, *(room.ring for room in plan.rooms), *(door.ring for door in plan.doors)]
    assert all(shapely.Polygon(ring).is_valid for ring in rings)
    assert plan.verts.min(axis=0) == pytest.approx([0.1, 0.1])
    parts = [room.polygon for room in plan.rooms] + [d.polygon for d in plan.doors if d.kind != "entrance"]
    assert shapely.union_all(parts).symmetric_difference(plan.free_space).area < 0.05
    assert sum(part.area for part in parts) - shapely.union_all(parts).area < 0.05
    assert len(disc_centre_areas(plan.free_space, 0.2)) == 1
    assert nx.number_connected_components(rooms_graph(plan)) == 1
    assert decode(encode(plan)) == plan


def walls_in_source(plan: FloorPlan) -> shapely.Geometry:
    """The free space where the plan's frame says it is in the source."""
    return shapely.transform(plan.free_space, lambda points: source_points_from_plan(plan.frame, points))


def placed(shape: shapely.Geometry) -> shapely.Geometry:
    x, y = shape.bounds[:2]
    return shapely.transform(shape, lambda points: points - (x, y))


def without_cuts(plan: FloorPlan) -> shapely.Geometry:
    """Free space less what was cut: where a cut is made depends on the sample, and that on the axes."""
    return plan.free_space.difference(shapely.union_all([d.polygon for d in plan.doors if d.kind == "cut"]))


@given(houses)
@quick
def test_every_house_is_sound_and_has_its_rooms_and_doors(house: House) -> None:
    plan = plan_of(house.parts())
    sound(plan)
    assert sorted(room.area for room in plan.rooms) == pytest.approx(house.areas(), abs=0.05)
    doors = [d for d in plan.doors if d.kind == "door"]
    shut = 1 if 0 <= house.closed < len(plan.rooms) - 1 else 0
    assert len(doors) == len(plan.rooms) - 1 - shut
    assert all(d.width == pytest.approx(house.door, abs=0.011) for d in doors)
    assert sum(d.kind == "cut" for d in plan.doors) == shut


@given(houses, st.sampled_from([90.0, 180.0, 270.0]))
@quick
def test_a_house_that_is_turned_gives_the_plan_turned(house: House, degrees: float) -> None:
    mesh = joined(house.parts())
    plan, again = plan_of(level(mesh)), plan_of(level(turned(mesh, degrees)))
    expected = placed(shapely.affinity.rotate(without_cuts(plan), degrees, origin=(0, 0)))
    assert difference(expected, placed(without_cuts(again))) < 0.01
    assert sorted(d.width for d in plan.doors) == pytest.approx(sorted(d.width for d in again.doors), abs=0.011)


@given(houses)
@quick
def test_a_house_in_a_mirror_gives_the_plan_in_a_mirror(house: House) -> None:
    mesh = joined(house.parts())
    mirrored = Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1])
    plan, again = plan_of(level(mesh)), plan_of(level(mirrored))
    expected = placed(affine_transform(without_cuts(plan), (-1, 0, 0, 1, 0, 0)))
    assert difference(expected, placed(without_cuts(again))) < 0.01


@given(houses, st.floats(-400, 400), st.floats(-400, 400))
@quick
def test_a_house_that_is_moved_gives_the_same_plan_and_the_frame_says_where(house: House, dx: float, dy: float) -> None:
    mesh = joined(house.parts())
    plan, again = plan_of(level(mesh)), plan_of(level(turned(mesh, 0.0, (dx, dy, 0.0))))
    assert difference(plan.free_space, again.free_space) < 0.01
    there = affine_transform(walls_in_source(plan), (1, 0, 0, 1, dx, dy))
    assert difference(there, walls_in_source(again)) < 0.01


@given(houses)
@quick
def test_the_frame_maps_the_plan_between_the_walls(house: House) -> None:
    plan = plan_of(house.parts())
    free = walls_in_source(plan)
    boxes = [shapely.box(*part.bounds[0, :2], *part.bounds[1, :2]) for part in house.parts() if part.bounds[0, 2] < 0.2]
    standing = shapely.union_all(boxes)
    cut = [d.polygon.area for d in plan.doors if d.kind == "cut"]
    assert free.intersection(standing).area < sum(cut) + 0.01 * free.length
    assert shapely.union_all([free, standing]).area == pytest.approx(shapely.box(*standing.bounds).area, rel=0.005)


@given(houses, st.randoms(use_true_random=False))
@quick
def test_how_the_mesh_is_written_down_does_not_matter(house: House, random: object) -> None:
    parts = house.parts()
    plan = plan_of(parts)
    again = [part.copy() for part in parts]
    random.shuffle(again)
    for part in again:
        if random.random() < 0.3:
            part.invert()
    mesh = joined(again)
    order = np.array(random.sample(range(len(mesh.faces)), len(mesh.faces)))
    rewritten = plan_of(level(Mesh(mesh.vertices, np.roll(mesh.faces, 1, axis=1)[order])))
    assert difference(without_cuts(plan), without_cuts(rewritten)) < 0.001
    assert sorted(d.kind for d in plan.doors) == sorted(d.kind for d in rewritten.doors)


@given(houses, st.integers(5, 40).map(lambda k: k / 100))
@quick
@pytest.mark.slow
def test_walls_of_any_thickness_leave_the_rooms_their_size(house: House, thickness: float) -> None:
    other = replace(house, thickness=thickness)
    plan = plan_of(other.parts())
    assert sorted(room.area for room in plan.rooms) == pytest.approx(other.areas(), abs=0.05)
    assert [d.polygon.area / d.width for d in plan.doors] == pytest.approx([thickness] * len(plan.doors), abs=0.02)


@given(houses, st.floats(5.0, 85.0))
@tries(8, derandomize=True)
@pytest.mark.slow
def test_a_house_askew_keeps_its_areas_and_doors(house: House, degrees: float) -> None:
    mesh = joined(house.parts())
    plan, askew = plan_of(level(mesh)), plan_of(level(turned(mesh, degrees)))
    sound(askew)
    assert sorted(r.area for r in askew.rooms) == pytest.approx(sorted(r.area for r in plan.rooms), rel=0.01)
    assert sorted(d.kind for d in askew.doors) == sorted(d.kind for d in plan.doors)


@pytest.mark.slow
@given(houses, st.integers(0, 2**32 - 1), st.sampled_from([0.001, 0.005]))
@tries(20, derandomize=True)
def test_boxes_that_do_not_quite_meet_make_the_same_rooms_and_doors(house: House, seed: int, amount: float) -> None:
    rng = np.random.default_rng(seed)
    shaken = []
    for part in house.parts():
        (x1, y1, low), (x2, y2, high) = part.bounds
        dx1, dy1, dx2, dy2 = rng.uniform(-amount, amount, 4)
        shaken.append(box((x1 + dx1, y1 + dy1, x2 + dx2, y2 + dy2), low, high))
    plan, clean = plan_of(shaken), plan_of(house.parts())
    sound(plan)
    assert sorted(room.area for room in plan.rooms) == pytest.approx(house.areas(), abs=0.2)
    assert sorted(d.kind for d in plan.doors) == sorted(d.kind for d in clean.doors)
