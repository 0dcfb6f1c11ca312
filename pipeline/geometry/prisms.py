"""Hold walls that all stand upright, as areas of the plan between two heights, and give their triangles on demand.

Drawings, and the maps of robots, describe walls as areas. Their sections are at hand, so no mesh needs to be cut
(``wall_sections.section_from_bodies``). Most plans are made without the triangles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.tolerances import SAME_M2
from pipeline.geometry.areas import Shapes, triangulate
from pipeline.geometry.mesh_slicing import EndCaps
from pipeline.geometry.meshes import NO_MESH, Mesh, merge_meshes
from pipeline.tolerances import POINT_M

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prism:
    """An upright body: its area in the plan, and the heights (metres) between which it stands."""

    area: BaseGeometry
    bottom_m: float
    top_m: float


class Prisms(Mesh):
    """Upright bodies, usable as a mesh. To change triangles, make a ``Mesh`` of them first."""

    bodies: tuple[Prism, ...]

    def __init__(self, bodies: Iterable[Prism]) -> None:
        """Keep the bodies that have an area and a height."""
        object.__setattr__(self, "bodies", _solid(bodies))

    @cached_property
    def _mesh(self) -> Mesh:
        return merge_meshes(make_prisms(each.area, each.bottom_m, each.top_m) for each in self.bodies)

    @property
    def vertices(self) -> Floats:
        """(n, 3) metres."""
        return self._mesh.vertices

    @property
    def faces(self) -> npt.NDArray[np.int64]:
        """(m, 3) indices of vertices."""
        return self._mesh.faces

    @property
    def is_empty(self) -> bool:
        """Whether there is no body."""
        return not self.bodies

    @property
    def is_cloud(self) -> bool:
        """False: bodies are not points."""
        return False

    @cached_property
    def heights(self) -> Floats:
        """(n,) at which bodies begin and end, metres above the level's floor."""
        return np.unique([height for each in self.bodies for height in (each.bottom_m, each.top_m)])

    def is_upright_between(self, low: float, high: float) -> bool:
        """Return whether every section between two heights is the same."""
        return not ((self.heights >= low) & (self.heights <= high)).any()

    def may_end_between(self, low: float, high: float) -> bool:
        """Return whether a body that stands at the lower height may end below the higher one."""
        return any(low <= each.top_m <= high for each in self.bodies)

    def bodies_at(self, height: float) -> Shapes:
        """Return the polygons (n,) of the bodies that stand at a height."""
        areas = [each.area for each in self.bodies if each.bottom_m < height < each.top_m]
        return np.asarray(shapely.get_parts(np.array(areas, dtype=np.object_)))

    @property
    def caps(self) -> EndCaps:
        """No caps: no face of an upright body slopes."""
        return EndCaps(np.zeros((0, 3, 3)))


class WallsWithOpenings(Prisms):
    """Walls of one height on the floor, and the openings through them; they are cut up when somebody asks for bodies.

    ``standing`` is the plan area of the walls from the floor to ``top_m``, between the ``openings`` (plan areas).
    """

    standing: BaseGeometry
    openings: tuple[Polygon, ...]
    top_m: float
    _cut: Callable[[], Iterable[Prism]]

    def __init__(
        self,
        standing: BaseGeometry,
        openings: Iterable[Polygon],
        top_m: float,
        cut: Callable[[], Iterable[Prism]],
    ) -> None:
        """Keep the walls; ``cut`` returns the bodies: what stands, and what is under and over the openings."""
        given = {"standing": _without_specks(standing), "openings": tuple(openings), "top_m": top_m, "_cut": cut}
        for name, value in given.items():
            object.__setattr__(self, name, value)

    @cached_property
    def bodies(self) -> tuple[Prism, ...]:  # type: ignore[override]
        """The bodies that have an area and a height."""
        return _solid(self._cut())

    @property
    def highest_m(self) -> float:
        """The height at which the highest body ends, metres."""
        return self.top_m


def _solid(bodies: Iterable[Prism]) -> tuple[Prism, ...]:
    found = (Prism(_without_specks(each.area), each.bottom_m, each.top_m) for each in bodies if _is_high(each))
    return tuple(each for each in found if not each.area.is_empty)


def _is_high(body: Prism) -> bool:
    return body.top_m - body.bottom_m >= POINT_M


def _without_specks(area: BaseGeometry) -> BaseGeometry:
    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and part.area > SAME_M2]
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def make_prisms(shape: BaseGeometry, bottom_m: float, top_m: float) -> Mesh:
    """Return a body that stands on a plan shape, or nothing if it has no height."""
    polygons = [p for p in shapely.get_parts(shape) if isinstance(p, Polygon) and p.area > SAME_M2]
    if top_m - bottom_m < POINT_M or not polygons:
        return NO_MESH
    return merge_meshes([_prism(shapely.orient_polygons(polygon), bottom_m, top_m) for polygon in polygons])


def _prism(polygon: Polygon, bottom_m: float, top_m: float) -> Mesh:
    points, triangles = triangulate(polygon)
    corners = points[triangles]
    flat = [_lift_triangles(corners, top_m), _lift_triangles(corners[:, ::-1], bottom_m)]
    sides = [_sides(shapely.get_coordinates(ring), bottom_m, top_m) for ring in (polygon.exterior, *polygon.interiors)]
    vertices = np.concatenate([*flat, *sides]).reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3))


def _lift_triangles(corners: Floats, z: float) -> Floats:
    """Triangles (n, 3, 2) at a height: (n, 3, 3)."""
    return np.concatenate([corners, np.full((*corners.shape[:2], 1), z)], axis=2)


def _sides(ring: Floats, bottom_m: float, top_m: float) -> Floats:
    """Upright triangles (n, 3, 3) over a closed ring that has the body on its left."""
    a, b = ring[:-1], ring[1:]
    low, high = np.full((len(a), 1), bottom_m), np.full((len(a), 1), top_m)
    a0, b0, a1, b1 = np.hstack([a, low]), np.hstack([b, low]), np.hstack([a, high]), np.hstack([b, high])
    return np.concatenate([np.stack([a0, b0, b1], axis=1), np.stack([a0, b1, a1], axis=1)])
