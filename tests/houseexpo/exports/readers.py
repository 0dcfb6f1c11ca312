"""Shapes back from the files, without our code."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np
import pytest
import shapely
import trimesh
from shapely.geometry.base import BaseGeometry

from houseexpo import FloorPlan


def near(plan: FloorPlan) -> object:
    """Return what an area equals that is the plan's to 1 %."""
    return pytest.approx(plan.area, rel=0.01)


def enclosed(walls: Iterable[BaseGeometry]) -> BaseGeometry:
    """What a set of walls closes in: everything inside their outer faces but themselves."""
    solid = shapely.union_all([wall.buffer(1e-4, join_style="mitre") for wall in walls])
    hull = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(solid)])
    return shapely.difference(hull, solid)


def solid_at(mesh: trimesh.Trimesh, height: float) -> list[BaseGeometry]:
    """What stands at a height of a y-up mesh, seen from above; a ray crosses its border an odd number of times."""
    segments = trimesh.intersections.mesh_plane(mesh, plane_normal=(0, 1, 0), plane_origin=(0, height, 0))
    lines = shapely.linestrings(np.stack([segments[..., 0], -segments[..., 2]], axis=-1))
    noded = shapely.union_all(lines, grid_size=1e-5)
    faces = shapely.get_parts(shapely.polygonize([noded]))
    points = shapely.get_coordinates(shapely.point_on_surface(faces))
    rays = shapely.linestrings(np.stack([points, points + np.array((100.0, 37.7))], axis=1))
    crossed = shapely.intersects(rays[:, None], shapely.get_parts(noded)[None]).sum(axis=1)
    return [face for face, count in zip(faces, crossed, strict=True) if count % 2]


def parsed(text: bytes) -> ET.Element:
    """The root of an XML file that was just written."""
    return ET.fromstring(text)  # noqa: S314  # our own text


def box_of(part: ET.Element) -> tuple[BaseGeometry, float, float] | None:
    """Footprint, foot and top of a collision that is a box."""
    size = part.findtext("geometry/box/size")
    if size is None:
        return None
    x, y, z, roll, pitch, yaw = map(float, part.findtext("pose").split())
    assert (roll, pitch, yaw) == (0, 0, 0)
    wide, deep, high = map(float, size.split())
    shape = shapely.box(x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2)
    return shape, round(z - high / 2, 6), round(z + high / 2, 6)


def polyline_of(part: ET.Element) -> tuple[BaseGeometry, float, float]:
    """Footprint, foot and top of a collision that is an extruded polyline."""
    x, y, z, *_ = map(float, part.findtext("pose").split())
    assert (x, y) == (0, 0)
    points = [tuple(map(float, point.text.split())) for point in part.iter("point")]
    return shapely.Polygon(points), z, z + float(part.findtext("geometry/polyline/height"))


def stage_blocks(text: str) -> tuple[list[BaseGeometry], tuple[float, ...], tuple[float, ...]]:
    """Blocks, size and pose of the model of walls in a Stage world."""
    model = text[text.index("\nmodel\n") :]
    blocks = []
    for line in re.findall(r"block \((.*)\)", model):
        count = int(re.search(r"points (\d+)", line)[1])
        points = [tuple(map(float, p.split())) for p in re.findall(r"point\[\d+\] \[([^\]]*)\]", line)]
        assert len(points) == count
        blocks.append(shapely.Polygon(points))

    def numbers(key: str) -> tuple[float, ...]:
        return tuple(map(float, re.search(rf"  {key} \[([^\]]*)\]", model)[1].split()))

    return blocks, numbers("size"), numbers("pose")
