"""Make a plan of a storey that the search has rejected, from the walls and rooms that a person gives.

R1  This applies only if a person gave a correction of the storey, and the search found no rooms.
R2  The walls that a person gives are added to the storey, and it is searched again. An end of such a wall is continued
    to another wall, or to what stands, within a hand's breadth.
R3  If that gives no plan either, the rooms are those that a person gives: the areas between corners
    (``room_outline``), and the places that walls close all round (``room``). All other corrections are applied to the
    plan of these, but a line that was said to be no wall before opens no room that is drawn on it.
R4  If a person gives no rooms, the first rejection stands, and says what would help.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Correction
from houseexpo.corrections.apply import Effect, is_at_edge
from houseexpo.corrections.openings import drawn_walls
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.plan import Room
from houseexpo.plan.room_labels import UNLABELLED
from houseexpo.tolerances import SMALLEST_SAID_ROOM_M2
from pipeline.geometry.areas import enclosed_pieces
from pipeline.geometry.meshes import Mesh, merge_meshes
from pipeline.geometry.prisms import Prism, Prisms, make_prisms
from pipeline.rejection import Rejection
from pipeline.stages.vectorise import shifted_frame
from pipeline.tolerances import CRACK_M, HAND_M
from pipeline.values import Layout, Level, Spaces

FOUNDING: Final = ("wall", "room", "room_outline")
"""The words that can make a plan of a storey that the search has rejected."""


def may_be_founded(level: Level) -> bool:
    """Return whether a person says something of a level that can make a plan where the search finds none (R1)."""
    return any(each.word in FOUNDING for each in level.corrections)


def said_walls(level: Level, standing: BaseGeometry) -> list[Polygon]:
    """Return the walls that a person says, as areas of the level frame, with ends that meet what is near (R2)."""
    return drawn_walls([_line(level, each) for each in level.corrections if each.word == "wall"], standing)


def _line(level: Level, said: Correction) -> LineString:
    return LineString(_points(level, said))


def _points(level: Level, said: Correction) -> np.ndarray:
    return np.asarray(plan_points_from_source(level.frame, np.array(said.points, dtype=np.float64)))


def level_with_walls(level: Level, walls: Sequence[Polygon]) -> Level:
    """Return a level in which more walls stand, from the floor to the ceiling; its other words are left."""
    rest = tuple(each for each in level.corrections if each.word != "wall")
    old, top = level.walls, level.ceiling_m
    new: Mesh
    if isinstance(old, Prisms) or old.is_empty:
        bodies = old.bodies if isinstance(old, Prisms) else ()
        new = Prisms([*bodies, *(Prism(wall, 0.0, top) for wall in walls)])
    elif old.is_cloud:
        points = [_cloud_of(wall, top) for wall in walls]
        new = Mesh(np.concatenate([old.vertices, *points]), old.faces)
    else:
        new = merge_meshes([old, *(make_prisms(wall, 0.0, top) for wall in walls)])
    return replace(level, walls=new, corrections=rest)


def _cloud_of(wall: Polygon, top_m: float) -> np.ndarray:
    ring = wall.exterior
    at = shapely.line_interpolate_point(ring, np.arange(0.0, ring.length, CRACK_M))  # less than a scanner's
    heights = np.arange(0.0, top_m, CRACK_M)
    plan = np.repeat(shapely.get_coordinates(at), len(heights), axis=0)
    return np.column_stack([plan, np.tile(heights, len(at))])


def records_of_walls(level: Level, without: Rejection) -> Iterator[dict[str, Any]]:
    """Yield what became of the walls that a person says, for the plan's provenance."""
    for each in level.corrections:
        if each.word == "wall":
            length = _line(level, each).length
            said = f"a wall of {length:.2f} m stands there; without it the house was rejected ({without.reason})"
            yield Effect(each, "done", said).as_record()


def record_of_founder(said: Correction, plan: FloorPlan, without: Rejection) -> dict[str, Any]:
    """Return what became of the word that made the first room, for the plan's provenance."""
    text = f"a room of {plan.area:.1f} m2 is there; without it the house was rejected ({without.reason})"
    return Effect(said, "done", text).as_record()


def words_of_founded(level: Level, founder: Correction) -> tuple[list[Correction], list[dict[str, Any]]]:
    """Return the words of a storey that its first room leaves to be applied, and records of the others (R3)."""
    earlier = level.corrections[: level.corrections.index(founder)] if founder.word == "room_outline" else ()
    room = Polygon(_points(level, founder)) if earlier else Polygon()
    idle = [each for each in earlier if each.word == "no_wall" and is_at_edge(_line(level, each), room)]
    rest = [each for each in level.corrections if each is not founder and each not in idle]
    return rest, [Effect(each, "none", "a room was drawn there later").as_record() for each in idle]


def found_plan(level: Level, standing: BaseGeometry) -> tuple[FloorPlan, Correction, list[Polygon]] | None:
    """Return a plan of one room that a person says, the word that says it, and all closed spaces (R3).

    ``standing`` are the walls. The plan's frame leads to the level's source, its first corner lies at the margin. None
    if nothing that is said encloses a room.
    """
    closed = enclosed_pieces(standing)[1]
    for said in level.corrections:
        shape = _room_of(level, said, closed)
        if shape is not None:
            return _plan_of(level, shape), said, closed
    return None


def _room_of(level: Level, said: Correction, closed: Sequence[Polygon]) -> Polygon | None:
    if said.word == "room_outline":
        return Polygon(_points(level, said))
    if said.word == "room":
        point = shapely.Point(_points(level, said)[0])
        return next((each for each in closed if each.covers(point) and each.area >= SMALLEST_SAID_ROOM_M2), None)
    return None


def _plan_of(level: Level, shape: Polygon) -> FloorPlan:
    shift = HAND_M - np.array(shape.bounds[:2])  # ``min(verts)`` of every plan, as published
    ring = np.round(shapely.get_coordinates(shapely.orient_polygons(shape).exterior)[:-1] + shift, 2)
    holes = tuple(np.round(shapely.get_coordinates(hole)[:-1] + shift, 2) for hole in shape.interiors)
    return FloorPlan(
        level.id,
        ring,
        1,
        {},
        holes,
        rooms=(Room(0, UNLABELLED, ring, holes, (), 1.0),),
        frame=shifted_frame(level.frame, shift),
        provenance=dict(level.provenance),
    )


def bare_layout(standing: BaseGeometry, closed: Sequence[Polygon]) -> tuple[Layout, Spaces]:
    """Return the layout and the spaces of a storey of which only what stands is known."""
    ground, _ = enclosed_pieces(standing)
    return Layout(standing, ground, (), (), tuple(closed)), Spaces(ground, (), ())
