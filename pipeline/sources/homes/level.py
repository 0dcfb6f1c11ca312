"""Convert a generated home to a level for the stages: walls with doors under lintels, a floor, rooms with boxes.

Walls are prisms: what stands between spaces and around them, from the floor to the ceiling, except the doors; there a
sill lies and a lintel hangs, as in SUNCG. Front doors lead through the outer wall and stay closed in the plan.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.plan import Frame
from houseexpo.plan.room_labels import canonical
from pipeline.geometry.areas import polygons_of, triangulate
from pipeline.geometry.meshes import Mesh
from pipeline.sources.homes.values import Home
from pipeline.sources.tolerances import LOOP_M2
from pipeline.values import MADE, Level, SourceRoom

WALL_TOP_M: Final = 2.73
SILL_M: Final = 0.04
DOOR_HEAD_M: Final = 2.12
"""Heights above the floor, of SUNCG's houses."""

Meshed: TypeAlias = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]
"""Points (n, 3): plan x, plan y, height, metres; texture (n, 2); faces (m, 3), outward in that frame."""


def level_from_home(home: Home) -> Level:
    """Return the one level of a home."""
    return Level(
        id=home.id,
        walls=_walls(home),
        ceiling_m=WALL_TOP_M,
        frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), up="z", floor=0.0, level=0),
        floor=shapely.buffer(shapely.union_all(home.spaces), home.wall_m, join_style="mitre"),
        sills=True,
        rooms=tuple(
            SourceRoom((each.label,) if each.label else (), _labels(each.label), box=each.box) for each in home.boxes
        ),
        room_count=home.room_count,
        provenance={"source": MADE, "style": "home", "sha256": home_digest(home)},
    )


def home_digest(home: Home) -> str:
    """SHA-256 of what a home is, in hex digits."""
    parts = [shapely.to_wkb(shapely.normalize(space)) for space in home.spaces]
    parts += [repr((home.doors, home.fronts, home.boxes, home.wall_m, home.room_count)).encode()]
    return hashlib.sha256(b"".join(parts)).hexdigest()


def _labels(word: str | None) -> tuple[str, ...]:
    label = canonical(word) if word else None
    return () if label is None else (label,)


def _walls(home: Home) -> Mesh:
    """Walls stand, sills lie, lintels hang."""
    spaces = shapely.union_all(home.spaces)
    shell = shapely.union_all(shapely.buffer(home.spaces, home.wall_m, join_style="mitre"))
    solid = shapely.difference(shell, spaces)
    gaps = shapely.box(*np.array([door.rect for door in (*home.doors, *home.fronts)]).reshape(-1, 4).T)
    open_ = shapely.union_all(gaps)
    standing = [(each, 0.0, WALL_TOP_M) for each in pieces_of(shapely.difference(solid, open_))]
    crossed = pieces_of(shapely.intersection(solid, open_))
    hanging = [(each, *heights) for each in crossed for heights in ((0.0, SILL_M), (DOOR_HEAD_M, WALL_TOP_M))]
    return prisms_mesh([*standing, *hanging])


def prisms_mesh(prisms: Sequence[tuple[shapely.Polygon, float, float]]) -> Mesh:
    """Return one mesh of closed prisms, each given by its polygon and the heights between which it stands."""
    meshes = [prism_mesh(*each) for each in prisms]
    starts = np.cumsum([0] + [len(points) for points, _, _ in meshes[:-1]])
    return Mesh(
        np.concatenate([points for points, _, _ in meshes]),
        np.concatenate([faces + start for (_, _, faces), start in zip(meshes, starts, strict=True)]),
    )


def pieces_of(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """Return the polygons of a shape that are no gaps between lines."""
    return [each for each in polygons_of(shape) if each.area > LOOP_M2]


def prism_mesh(polygon: shapely.Polygon, low: float, high: float) -> Meshed:
    """Return the closed mesh of a slab over a polygon, from one height to another."""
    plan, top, sides = _triangulate(polygon)
    n = len(plan)
    faces = np.concatenate([top + n, top[:, ::-1], sides])
    twice = np.tile(plan, (2, 1))
    return np.column_stack([twice, np.repeat([low, high], n)]), twice, faces


@lru_cache(maxsize=2)  # a room's ceiling is its floor again
def _triangulate(
    polygon: shapely.Polygon,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return a polygon's corners, its triangles, and those of a band round it whose upper corners come n later."""
    plan, top = triangulate(polygon)
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    a = np.arange(len(plan))
    starts = np.cumsum([0, *sizes[:-1]])
    b = np.concatenate([start + np.roll(np.arange(size), -1) for start, size in zip(starts, sizes, strict=True)])
    n = len(plan)
    return plan, top, np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
