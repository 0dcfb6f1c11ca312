"""The facade: a plan that offers what the floors above it do, so that users need one object (``plan.grid()``).

``houseexpo.plan`` holds the plan as data. Grids, graphs, walls, drawings and rooms are made by functions of
``houseexpo.grids``, ``analysis``, ``drawing`` and ``inference``, which take that data and know nothing of this file. A
method here says what it gives and calls one of them; it computes nothing, and imports it where it is called, so that
``import houseexpo`` stays quick. An import contract in ``pyproject.toml`` keeps the floors apart.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from houseexpo.plan import json_codec
from houseexpo.plan.model import PlanData
from houseexpo.plan.moving import moved
from houseexpo.plan.parts import Navigability, Reach
from houseexpo.plan.repair import even_odd

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import networkx as nx
    from matplotlib.axes import Axes
    from shapely import MultiPolygon, Polygon

    from houseexpo.analysis.features import Layer
    from houseexpo.grids.frame import GridFrame
    from houseexpo.plan.parts import Box, Door, Frame, PlanObject, Room
    from houseexpo.plan.quality import Quality


def decode(data: bytes | str) -> FloorPlan:
    """Read one plan from its JSON; PlanError as ``houseexpo.plan.json_codec.decode_as`` says."""
    return json_codec.decode_as(FloorPlan, data)


class MeasuredReach(Reach):
    """What is recorded of a plan's navigability; called with a radius that is not recorded, it measures."""

    __slots__ = ("_space",)

    def __init__(self, known: Mapping[str, Navigability], space: Callable[[], Polygon | MultiPolygon]) -> None:
        super().__init__(known)
        self._space = space

    def _unknown(self, radius_m: float) -> Navigability:
        from houseexpo.analysis.navigability import navigability

        return navigability(self._space(), (radius_m,))[f"{radius_m:.2f}"]


@dataclass(frozen=True, eq=False, repr=False)
class FloorPlan(PlanData):
    """One floor plan of the data set (docs/format.md), published or ours.

    ``verts`` stays as published; shapes and finiteness are checked when a plan is made (PlanError), simple geometry is
    not: 1,285 published rings touch or cross themselves. ``outline`` and ``free_space`` are valid in any case, and
    ``repair`` says what it took.

    Examples
    --------
    >>> plan = FloorPlan("square", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
    >>> plan
    FloorPlan('square', 16.0 m2, 4.0 x 4.0 m, 4 vertices, room_num 1)
    >>> plan.bbox
    (0.1, 0.1, 4.1, 4.1)
    """

    if TYPE_CHECKING:  # a ring may be any list of [x, y]; once made, it is an array

        def __init__(  # noqa: PLR0917 - the fields
            self,
            id: str,  # noqa: A002 - the field's name
            verts: npt.ArrayLike,
            room_num: int,
            room_category: Mapping[str, Iterable[Box]],
            holes: Iterable[npt.ArrayLike] = (),
            rooms: Iterable[Room] = (),
            doors: Iterable[Door] = (),
            frame: Frame | None = None,
            navigability: Mapping[str, Navigability] = ...,
            provenance: Mapping[str, Any] | None = None,
            quality: Quality | None = None,
            objects: Iterable[PlanObject] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        space = partial(even_odd, self.verts, self.holes)  # not a method of self: a cycle would outlive the plan
        self._set("navigability", MeasuredReach(self.navigability, space))

    def moved(self, dx: float, dy: float) -> FloorPlan:
        """Return the plan shifted by (dx, dy) metres; its frame still leads to the same place in the source."""
        return moved(self, dx, dy)

    def centred(self) -> FloorPlan:
        """Return the plan with its origin at the centroid of the free space, as the paper's text has it."""
        centre = self.free_space.centroid
        return self.moved(-centre.x, -centre.y)

    @cached_property
    def divided(self) -> FloorPlan:
        """The plan with rooms and doors: itself, or where it records none, as published, what ``with_rooms`` finds."""
        if self.rooms:
            return self
        from houseexpo.inference import with_rooms

        return with_rooms(self)

    def walls(self, thickness: float = 0.1) -> tuple[Polygon, ...]:
        """Walls as polygons, metres: what lies within ``thickness`` of the floor and is no floor, holes whole.

        Walls between rooms that are thinner than twice ``thickness`` come out as thick as they are; doors stay open.
        Furniture is no wall: what it stands on is floor.
        """
        from houseexpo.analysis.walls import walls_around

        return walls_around(self.floor, thickness)

    def grid_frame(self, pixels_per_metre: float = 25.0) -> GridFrame:
        """Where the grids below stand: one cell of margin all round, row 0 at the lowest y, as published."""
        from houseexpo.grids.frame import GridFrame

        return GridFrame.around(self._bounds, pixels_per_metre)

    def grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.uint8]:
        """Occupancy (rows, cols): 0 where the cell's centre is free, 1 where it is in a wall or outside.

        Examples
        --------
        >>> plan = FloorPlan("square", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
        >>> plan.grid(2).tolist()[:3]
        [[1, 1, 1, 1, 1, 1], [1, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 1]]
        """
        from houseexpo.grids.raster import free_mask

        mask, _ = free_mask(self, frame=self.grid_frame(pixels_per_metre))
        return (~mask).view(np.uint8)

    def room_grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int32]:
        """Ids of rooms of ``divided`` (rows, cols), -1 where there is none; the grid is that of ``grid``."""
        from houseexpo.grids.raster import room_mask

        return room_mask(self.divided, self.grid_frame(pixels_per_metre))

    def door_grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int32]:
        """Ids of doors of ``divided`` (rows, cols), -1 where there is none; the grid is that of ``grid``."""
        from houseexpo.grids.raster import door_mask

        return door_mask(self.divided, self.grid_frame(pixels_per_metre))

    def distance_field(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.float32]:
        """Metres (rows, cols) from each free cell's centre to the nearest wall, 0 in walls; the grid is ``grid``'s."""
        from houseexpo.grids.raster import clearance

        return clearance(self.grid(pixels_per_metre) == 0, pixels_per_metre)

    def graph(self, *, outside: bool = False) -> nx.MultiGraph[int | str]:
        """Rooms of ``divided`` as nodes, doors as edges, with walking distances; ``analysis.geodesic`` says which."""
        from houseexpo.analysis.geodesic import walking_graph

        return walking_graph(self.divided, outside=outside)

    def to_cell(self, points: npt.ArrayLike, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int64]:
        """Plan metres (..., 2) as (x, y) to cells (..., 2) of ``grid`` as (row, col); they may lie outside it."""
        return self.grid_frame(pixels_per_metre).cells_from_points(points)

    def to_world(self, cells: npt.ArrayLike, pixels_per_metre: float = 25.0) -> npt.NDArray[np.float64]:
        """Cells (..., 2) of ``grid`` as (row, col) to the plan metres (..., 2) of their centres as (x, y)."""
        return self.grid_frame(pixels_per_metre).points_from_cells(cells)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        rooms: bool = True,
        labels: bool = True,
        doors: bool = True,
        objects: bool = True,
        walls: bool = True,
        wall_thickness: float = 0.1,
        title: str | None = None,
    ) -> Axes:
        """Draw the plan on a matplotlib axis, x right and y up, in metres.

        Parameters
        ----------
        ax
            The axis to draw on; by default that of a new figure.
        rooms, labels, doors, objects, walls
            What is drawn: rooms in their label's colour, their labels, doors by kind, furniture, walls.
            Rooms and doors of a published plan, which records none, are found first (``divided``).
        wall_thickness
            How thick the walls around the outline are drawn, metres.
        title
            A title of the axis.

        Returns
        -------
        The axis.

        Raises
        ------
        MissingDependencyError
            matplotlib is not installed.

        Examples
        --------
        >>> plan = FloorPlan("square", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
        >>> ax = plan.plot(title="4 x 4 m")
        >>> ax.get_xlabel()
        'x (m)'
        """
        from houseexpo.drawing.axes import plot_plan

        return plot_plan(
            self.divided if rooms or doors else self,
            ax,
            rooms=rooms,
            labels=labels,
            doors=doors,
            objects=objects,
            walls=walls,
            wall_thickness=wall_thickness,
            title=title,
        )

    def to_geopandas(self, layer: Layer = "rooms") -> Any:
        """Return the plan's rooms, doors or furniture as a ``geopandas.GeoDataFrame``, a row each, in metres.

        Parameters
        ----------
        layer
            "rooms", "doors", "objects" (furniture), or "plans" (one row: the free space). Rooms and doors of a
            published plan are found first (``divided``).

        Raises
        ------
        ConfigError
            There is no such layer.
        MissingDependencyError
            GeoPandas is not installed.
        """
        from houseexpo.analysis.features import features

        return features([self.divided], layer)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the plan to a JSON file; a file of that name is replaced only by a whole one."""
        from houseexpo.files import write_whole

        write_whole(Path(path), json_codec.encode(self) + b"\n")

    def _repr_svg_(self) -> str:
        """Show the plan in a notebook."""
        from houseexpo.drawing import svg

        return svg(self, size=480)
