"""Define ``FloorPlan``, a plan with methods such as ``grid()``, ``graph()`` and ``plot()``; read and save it as JSON.

``houseexpo.plan`` defines the plan as data. Functions in ``houseexpo.grids``, ``analysis``, ``drawing`` and
``inference`` take that data and compute grids, graphs, walls, drawings and rooms; they do not import this file. The
methods here compute nothing themselves. Each imports such a function when it is called, so that ``import houseexpo`` is
fast. An import contract in ``pyproject.toml`` keeps the layers apart.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, PlanError
from houseexpo.files import is_device
from houseexpo.plan import json_codec
from houseexpo.plan.model import PlanData, shift_plan
from houseexpo.plan.parts import Navigability, NavigabilityByRadius
from houseexpo.plan.repair import even_odd_polygons

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import networkx as nx
    from matplotlib.axes import Axes
    from shapely import MultiPolygon, Polygon

    from houseexpo.analysis.geodataframe import Layer
    from houseexpo.analysis.graph import WalkingPath
    from houseexpo.corrections import Override
    from houseexpo.corrections.apply import Corrected
    from houseexpo.drawing.styles import StyleName
    from houseexpo.grids.frame import GridFrame
    from houseexpo.plan.parts import Box, Door, Frame, PlanObject, Quality, Room


def decode(data: bytes | str) -> FloorPlan:
    """Read one plan from its JSON text.

    Parameters
    ----------
    data
        The JSON text, in UTF-8 if it is bytes.

    Raises
    ------
    PlanError
        The text is not valid JSON, a key is missing or of the wrong type, or the plan violates the format
        (docs/format.md). The error names the key, and the plan if its id can be read.
    """
    return json_codec.decode_plan_as(FloorPlan, data)


def load_plan(path: str | os.PathLike[str]) -> FloorPlan:
    """Read a plan from a JSON file.

    Parameters
    ----------
    path
        A JSON file with one plan: a published one or one that a build wrote.

    Raises
    ------
    PlanError
        The file does not contain a valid plan, or is a folder, a device or a pipe; the error names the file.
    """
    file = Path(path)
    if is_device(file):
        raise PlanError("expected a file, found a device or a pipe; save its content to a file", str(file))
    if file.is_dir():
        raise PlanError("expected a file, found a folder; houseexpo.open_dataset opens it", str(file))
    if "\0" in str(file):
        raise PlanError("expected the path of a file, found one with a null character; check it", repr(str(file)))
    try:
        return decode(file.read_bytes())
    except PlanError as error:
        raise PlanError(error.problem, f"{file}: {error.key}" if error.key else str(file), error.plan) from None


def save_plan(plan: FloorPlan, path: str | os.PathLike[str]) -> None:
    """Write a plan to a file, like ``plan.save(path)``.

    Parameters
    ----------
    plan
        The plan.
    path
        The file; its suffix selects what is written: the plan or a drawing (``FloorPlan.save``).

    Raises
    ------
    ConfigError
        The suffix is not supported.
    """
    plan.save(path)


class MeasuredNavigability(NavigabilityByRadius):
    """The navigability recorded in a plan; a call with a radius that is not recorded measures it."""

    __slots__ = ("_space",)

    def __init__(self, known: Mapping[str, Navigability], space: Callable[[], Polygon | MultiPolygon]) -> None:
        super().__init__(known)
        self._space = space

    def _missing_radius(self, radius_m: float) -> Navigability:
        from houseexpo.analysis.navigability import navigability

        return navigability(self._space(), (radius_m,))[f"{radius_m:.2f}"]


@dataclass(frozen=True, eq=False, repr=False)
class FloorPlan(PlanData):
    """One floor plan of the data set (docs/format.md), from a published file or built by this project.

    Coordinates are in metres, x right and y up. The constructor raises PlanError if an array has the wrong shape or is
    not finite. It keeps ``verts`` as given and accepts rings that touch or cross themselves, as 1,285 published rings
    do. ``outline`` and ``free_space`` are always valid polygons; ``repair`` describes what was repaired.

    Examples
    --------
    >>> plan = FloorPlan("square", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
    >>> plan
    FloorPlan('square', 16.0 m², 4.0 x 4.0 m, 4 vertices, 1 room in the source)
    >>> plan.bbox
    (0.1, 0.1, 4.1, 4.1)
    """

    if TYPE_CHECKING:  # the constructor takes any list of [x, y] as a ring; the attribute is an array

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
            windows: Iterable[Door] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        space = partial(even_odd_polygons, self.verts, self.holes)  # no method of self: a cycle would delay freeing it
        self._set("navigability", MeasuredNavigability(self.navigability, space))

    def corrected(self, said: Override) -> Corrected[FloorPlan]:
        """Apply a person's corrections; return the corrected plan and the effect of each correction.

        Points are in metres along the axes of the plan's source (``frame``), or the plan's own axes if it has no frame.
        ``keep``, ``drop`` and the keys of a whole file are for builds and have no effect here. ``room`` can add a space
        that the plan lacks only in a build, because only a build knows such spaces.

        Parameters
        ----------
        said
            The corrections: walls, openings, rooms, labels.

        Returns
        -------
        The corrected ``plan``, and ``effects``, one for each correction; an effect says what changed or why nothing
        did.

        Raises
        ------
        PlanError
            The plan has no rooms, and its outline cannot be repaired.

        Examples
        --------
        >>> from houseexpo import Override
        >>> plan = FloorPlan("square", [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)], 1, {})
        >>> found = plan.corrected(Override(wall=[[2, 0.1], [2, 4]], door=[[2, 1], [2, 1.9]]))
        >>> print(found.effects[1].sentence)
        a door of 0.90 m joins the room of 8.2 m2 and the room of 7.4 m2
        """
        from houseexpo.corrections.apply import correct_plan

        return correct_plan(self, said.corrections)

    def moved(self, dx: float, dy: float) -> FloorPlan:
        """Return the plan shifted by (dx, dy) metres; its frame is adjusted to map to the same place in the source.

        Parameters
        ----------
        dx, dy
            The shift along x and y, metres.
        """
        return shift_plan(self, dx, dy)

    def centred(self) -> FloorPlan:
        """Return the plan with its origin at the centroid of the free space, as the paper's text defines it."""
        centre = self.free_space.centroid
        return self.moved(-centre.x, -centre.y)

    @cached_property
    def divided(self) -> FloorPlan:
        """The plan with rooms and doors: the plan itself or, if it records no rooms, the result of ``with_rooms``."""
        if self.rooms:
            return self
        from houseexpo.inference import with_rooms

        return with_rooms(self)

    def walls(self, thickness: float = 0.1) -> tuple[Polygon, ...]:
        """Return the walls as polygons in metres: the area within ``thickness`` metres of the floor, and all holes.

        A wall between rooms that is thinner than twice ``thickness`` keeps its own thickness. Doors stay open.
        Furniture does not count as a wall; the area under it counts as floor.

        Parameters
        ----------
        thickness
            Thickness of the walls around the floor, metres.

        Raises
        ------
        ConfigError
            The thickness is not a positive number.
        """
        from houseexpo.analysis.walls import walls_around

        return walls_around(self.floor, thickness)

    def grid_frame(self, pixels_per_metre: float = 25.0) -> GridFrame:
        """Return the frame of this plan's grids: a margin of one cell all round, row 0 at the lowest y.

        Parameters
        ----------
        pixels_per_metre
            Cells per metre: 25 means cells of 4 cm.

        Raises
        ------
        ConfigError
            ``pixels_per_metre`` is not a positive number, the grid would have too many cells, or the plan would be
            smaller than 4 cells.
        """
        from houseexpo.grids.frame import GridFrame, check_not_too_coarse

        check_not_too_coarse(self._bounds, pixels_per_metre, self.id)
        return GridFrame.around(self._bounds, pixels_per_metre)

    def grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.uint8]:
        """Return the occupancy grid (rows, cols): 0 if the cell's centre is free, 1 if it is in a wall or outside.

        Parameters
        ----------
        pixels_per_metre
            Cells per metre: 25 means cells of 4 cm.

        Raises
        ------
        ConfigError
            As for ``grid_frame``.

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
        """Return the id of the room of ``divided`` in each cell (rows, cols), -1 without a room; cells as in ``grid``.

        Parameters
        ----------
        pixels_per_metre
            Cells per metre: 25 means cells of 4 cm.

        Raises
        ------
        ConfigError
            As for ``grid_frame``.
        """
        from houseexpo.grids.raster import room_ids

        return room_ids(self.divided, self.grid_frame(pixels_per_metre))

    def door_grid(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.int32]:
        """Return the id of the door of ``divided`` in each cell (rows, cols), -1 without a door; cells as in ``grid``.

        Parameters
        ----------
        pixels_per_metre
            Cells per metre: 25 means cells of 4 cm.

        Raises
        ------
        ConfigError
            As for ``grid_frame``.
        """
        from houseexpo.grids.raster import door_ids

        return door_ids(self.divided, self.grid_frame(pixels_per_metre))

    def distance_field(self, pixels_per_metre: float = 25.0) -> npt.NDArray[np.float32]:
        """Return the distance in metres (rows, cols) from each free cell's centre to the nearest wall, 0 in walls.

        The cells are those of ``grid``.

        Parameters
        ----------
        pixels_per_metre
            Cells per metre: 25 means cells of 4 cm.

        Raises
        ------
        ConfigError
            As for ``grid_frame``.
        """
        from houseexpo.grids.raster import distance_field

        return distance_field(self.grid(pixels_per_metre) == 0, pixels_per_metre)

    def graph(self, *, outside: bool = False) -> nx.MultiGraph[int | str]:
        """Return the graph of ``divided``: rooms as nodes, doors as edges, with walking distances.

        ``houseexpo.rooms_graph`` lists the attributes.

        Parameters
        ----------
        outside
            Whether entrances lead to a node "outside".
        """
        from houseexpo.analysis.graph import rooms_graph_with_distances

        return rooms_graph_with_distances(self.divided, outside=outside)

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
        figsize: tuple[float, float] | None = None,
        style: StyleName = "architect",
    ) -> Axes:
        """Draw the plan on a matplotlib axis, x right and y up, in metres.

        Parameters
        ----------
        ax
            The axis to draw on; by default, the axis of a new figure.
        rooms, labels, doors, objects, walls
            Whether to draw rooms, labels where they fit, doors, furniture and walls. For a published plan, which has no
            rooms and doors, the rooms and doors of ``divided`` are drawn.
        wall_thickness
            Thickness of the walls around the outline, metres.
        title
            Title of the axis.
        figsize
            Width and height of the new figure, inches; only without ``ax``.
        style
            "architect", "technical" (black and white) or "semantic" (doors coloured by kind), as in ``draw_plan``.

        Returns
        -------
        The axis.

        Raises
        ------
        ConfigError
            Both ``ax`` and ``figsize`` are given, or the style is unknown.
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
            figsize=figsize,
            style=style,
        )

    def to_geopandas(self, layer: Layer = "rooms") -> Any:
        """Return the plan's rooms, doors, walls or furniture as a ``geopandas.GeoDataFrame``, one row each, in metres.

        Parameters
        ----------
        layer
            "rooms", "doors", "walls" (0.1 m thick), "objects" (furniture), or "plans" (one row: the free space). The
            rooms and doors of a published plan are those of ``divided``.

        Raises
        ------
        ConfigError
            ``layer`` has another value.
        MissingDependencyError
            GeoPandas is not installed.
        """
        from houseexpo.analysis.geodataframe import make_geodataframe

        return make_geodataframe([self.divided], layer)

    def to_geojson(self, **options: Any) -> str:
        """Return ``divided`` as the GeoJSON text that ``houseexpo export --to geojson`` writes.

        Coordinates are in metres, with the house as seen from above, in the frame of its source if the plan has one.
        ``orientation="plan"`` and ``frame="plan"`` keep the plan's own coordinates.

        Parameters
        ----------
        **options
            The options of ``houseexpo.exports.geojson``, for example ``orientation`` and ``frame``.
        """
        from houseexpo.exports.geojson import geojson

        (text,) = geojson(self.divided, **options).values()
        return text.decode()

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The GeoJSON as a dict, in metres along the plan's own axes, like ``walls`` and ``shortest_path``.

        ``geopandas.GeoDataFrame.from_features(plan)`` and ``folium.GeoJson(plan)`` read it.
        """
        import json

        values: dict[str, Any] = json.loads(self.to_geojson(orientation="plan", frame="plan"))
        return values

    def shortest_path(self, start: npt.ArrayLike, goal: npt.ArrayLike, radius: float = 0.0) -> WalkingPath | None:
        """Return the shortest path between two points, or None if they are not connected.

        Parameters
        ----------
        start, goal
            The ends of the path (2,), (x, y) along the plan's own axes, metres.
        radius
            Radius of a disc-shaped robot, metres; the path is the path of its centre. 0 for a point.

        Returns
        -------
        The path: its corners ``points`` (n, 2) and its ``length``, metres.

        Raises
        ------
        ConfigError
            The radius is negative or not finite.

        Examples
        --------
        >>> plan = FloorPlan("corner", [(0, 0), (6, 0), (6, 6), (3, 6), (3, 3), (0, 3)], 1, {})
        >>> round(plan.shortest_path((0, 2.9), (3.1, 6)).length, 2)
        6.0
        """
        import shapely

        from houseexpo.analysis.graph import shortest_path
        from houseexpo.analysis.navigability import disc_centre_areas

        if not 0 <= radius < math.inf:
            raise ConfigError(f"radius: expected 0 or more metres, found {radius!r}")
        areas = shapely.MultiPolygon(disc_centre_areas(self.free_space, radius)) if radius else self.free_space
        return shortest_path(areas, start, goal)

    def save(self, path: str | os.PathLike[str], *, style: StyleName = "architect") -> None:
        """Write the plan to a file; an existing file is replaced only when the new one is complete.

        Parameters
        ----------
        path
            The file. Its suffix selects what is written: ``.json`` the plan, which ``load_plan`` reads; ``.png``,
            ``.svg`` or ``.pdf`` a drawing of ``divided``.
        style
            The style of a drawing, as in ``draw_plan``.

        Raises
        ------
        ConfigError
            The suffix is not one of these, or the style is unknown.
        """
        from houseexpo.files import write_atomically

        file = Path(path)
        kind = file.suffix.lower()
        if kind == ".json":
            content = json_codec.encode(self) + b"\n"
        elif kind in {".png", ".svg", ".pdf"}:
            from houseexpo.drawing import encode_drawing

            content = encode_drawing(self.divided, kind.removeprefix("."), style)
        else:
            raise ConfigError(
                "save: expected a file that ends in .json (the plan), .png, .svg or .pdf (a drawing), "
                f"found {file.name!r}; houseexpo.export writes other formats"
            )
        write_atomically(file, content)

    def _repr_svg_(self) -> str:
        """Show the plan in a notebook."""
        from houseexpo.drawing import svg

        return svg(self, size=480)
