"""Check rooms by seven rules (overlap, holes, pieces, least area and width, aspect, daylight), and find which adjoin.

The first six and their thresholds are those of floorplan_eval (github.com/birsakm/floorplan_eval, docs/metrics.md,
2026), which holds nine public data sets to them (``stats.audit``). They are loose: a person and a bed must fit.
Real homes break some of them too, so a share is to be compared with those of the public sets, not with zero.

R1  *Overlap*: the areas of all rooms add up to at most 2% more than the area that they cover together.
R2  *Holes*: at most 2% of the footprint is enclosed, belongs to no room, and is wider than a wall (0.6 m).
R3  *Pieces*: the rooms form one piece. Two rooms adjoin if each comes within 0.3 m of a common wall on at least 0.5 m.
R4  *Area*: a room has the least area of its type (``LIMITS``).
R5  *Width*: a room has the least clear width of its type: the diameter of the largest circle inside.
R6  *Aspect*: the sides of the smallest rotated rectangle round a room have at most the ratio of its type.
R7  *Daylight*: in a plan with windows, each room to live, cook, eat, sleep or work in has daylight (``LIGHT_M``).

Daylight comes by a window to the outside or to a balcony, a door to a balcony, an entrance as wide as a glazed door, or
a passage of that width to a room with one of these. R7 is ours, so that it does not count where plans are compared with
public data sets.

Rooms are polygons. A published plan has none; ``houseexpo.inference.with_rooms`` finds them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
from msgspec import Struct

from houseexpo.plan import PlanObject, Room
from houseexpo.plan.model import PlanData

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

Rule = Literal["overlap", "holes", "pieces", "area", "width", "aspect", "light"]

RULES: Final[Mapping[Rule, str]] = {
    "overlap": "Rooms overlap",
    "holes": "Enclosed holes",
    "pieces": "Several pieces",
    "area": "A room below its least area",
    "width": "A room below its least width",
    "aspect": "A room above its largest aspect",
    "light": "A habitable room without daylight",
}
"""The rules, with the heading under which the plans that break them are counted."""

MAX_OVERLAP: Final = 0.02
"""R1: share of the area that the rooms cover together."""
MAX_HOLES: Final = 0.02
"""R2: share of the footprint."""
BETWEEN_ROOMS_M: Final = 0.6
"""R2, R3: the thickest wall, metres; data sets drawn from images leave as much between rooms."""
SHARED_WALL_M: Final = 0.5
"""R3: the least length of wall that two adjoining rooms share, metres."""
LIGHT_M: Final = 1.5
"""R7: the least width of a glazed door to the outside, and of a passage that lets in light, metres; front doors are
narrower."""
HABITABLE: Final = frozenset({"living room", "kitchen", "bedroom", "dining room", "study"})
"""R7: types of rooms that need daylight."""


class RoomLimits(NamedTuple):
    """Least area (m2), least clear width (m) and largest aspect (None: any) of a type of room."""

    area_m2: float
    width_m: float
    aspect: float | None


LIMITS: Final[Mapping[str, RoomLimits]] = {
    "living room": RoomLimits(8.0, 2.4, 4.0),
    "kitchen": RoomLimits(3.0, 1.5, 4.0),
    "bedroom": RoomLimits(5.0, 2.0, 3.0),
    "bathroom": RoomLimits(1.5, 1.0, 3.5),
    "balcony": RoomLimits(1.0, 0.8, 10.0),
    "entrance": RoomLimits(1.0, 0.9, 5.0),
    "dining room": RoomLimits(4.0, 2.0, 3.5),
    "study": RoomLimits(4.0, 1.8, 3.0),
    "storage": RoomLimits(0.5, 0.6, 6.0),
    "corridor": RoomLimits(1.0, 0.8, None),
    "garage": RoomLimits(10.0, 2.4, 4.0),
    "closet": RoomLimits(0.5, 0.6, 6.0),
    "other": RoomLimits(0.5, 0.6, None),
}
"""The types of rooms and their limits (fpeval/rules.py). No label of ours is a laundry or an outdoor area."""

TYPES: Final[Mapping[str, str]] = {
    "Bedroom": "bedroom",
    "Child_Room": "bedroom",
    "Guest_Room": "bedroom",
    "Bathroom": "bathroom",
    "Toilet": "bathroom",
    "Kitchen": "kitchen",
    "Dining_Room": "dining room",
    "Living_Room": "living room",
    "Room": "other",
    "Office": "study",
    "Gym": "other",
    "Hallway": "corridor",
    "Hall": "corridor",
    "Lobby": "corridor",
    "Entryway": "entrance",
    "Garage": "garage",
    "Storage": "storage",
    "Wardrobe": "closet",
    "Boiler_room": "other",
    "Balcony": "balcony",
    "Terrace": "balcony",
    "Loggia": "balcony",
    "Aeration": "other",
    "Passenger_elevator": "other",
    "Freight_elevator": "other",
    "Unlabelled": "other",
}
"""The type of each label of HouseExpo. Terraces and loggias count as balconies, as they do in the public data sets."""


class AuditedRoom(Struct, array_like=True, frozen=True):
    """A room of an audited plan: its id and type, its area (m2), its clear width (m), its aspect, and its daylight.

    ``is_lit`` is None if the room needs no daylight, or the plan has no windows.
    """

    id: int
    type: str
    area_m2: float
    width_m: float
    aspect: float
    is_lit: bool | None = None

    def broken_rules(self) -> Iterator[Rule]:
        """Yield the rules that the room breaks (R4 to R7)."""
        limits = LIMITS[self.type]
        if self.area_m2 < limits.area_m2:
            yield "area"
        if self.width_m < limits.width_m:
            yield "width"
        if limits.aspect is not None and self.aspect > limits.aspect:
            yield "aspect"
        if self.is_lit is False:
            yield "light"

    def reasons(self) -> Iterator[str]:
        """Yield a description of each rule that the room breaks."""
        limits, name = LIMITS[self.type], f"room {self.id} ({self.type})"
        texts = {
            "area": f"{self.area_m2:.2f} m², at least {limits.area_m2:g}",
            "width": f"{self.width_m:.2f} m wide, at least {limits.width_m:g}",
            "aspect": f"aspect {self.aspect:.1f}, at most {limits.aspect or 0:g}",
            "light": "no daylight",
        }
        yield from (f"{name}: {texts[rule]}" for rule in self.broken_rules())


class PlanAudit(Struct, array_like=True, frozen=True):
    """What an audit found in a plan; thresholds are applied afterwards.

    ``overlap`` and ``holes`` are shares (R1, R2), ``pieces`` the number of pieces (R3).
    """

    rooms: list[AuditedRoom]
    overlap: float
    holes: float
    pieces: int

    def broken_rules(self) -> set[Rule]:
        """Return the rules that the plan breaks, those of its rooms included."""
        found: set[Rule] = {rule for room in self.rooms for rule in room.broken_rules()}
        if self.overlap > MAX_OVERLAP:
            found.add("overlap")
        if self.holes > MAX_HOLES:
            found.add("holes")
        if self.pieces > 1:
            found.add("pieces")
        return found

    def reasons(self) -> Iterator[str]:
        """Yield a description of each rule that the plan or a room breaks."""
        broken = self.broken_rules()
        if "overlap" in broken:
            yield f"rooms overlap by {self.overlap:.1%}, at most {MAX_OVERLAP:.0%}"
        if "holes" in broken:
            yield f"enclosed holes cover {self.holes:.1%}, at most {MAX_HOLES:.0%}"
        if "pieces" in broken:
            yield f"the rooms form {self.pieces} pieces"
        for room in self.rooms:
            yield from room.reasons()


def audit_plan(plan: PlanData) -> PlanAudit | None:
    """Audit a plan; return None if it has no rooms. A room is as large as without its furniture."""
    import shapely

    rooms = [room for room in plan.rooms if room.area > 0]
    if not rooms:
        return None
    shapes = [_with_furniture(room, plan.objects) for room in rooms]
    covered, lit = shapely.union_all(shapes), lit_rooms(plan)
    return PlanAudit(
        [_audit_room(room, shape, lit.get(room.id)) for room, shape in zip(rooms, shapes, strict=True)],
        round(float(shapely.area(shapes).sum() / covered.area) - 1.0, 6),
        round(_hole_share(covered), 6),
        _pieces(len(rooms), _adjoining(shapes)),
    )


def lit_rooms(plan: PlanData) -> dict[int, bool]:
    """Return for each habitable room of a plan with windows whether it has daylight (R7)."""
    if not plan.windows:
        return {}
    types = {room.id: TYPES.get(room.label, "other") for room in plan.rooms}
    outdoors = {None, *(room for room, kind in types.items() if kind == "balcony")}
    lit = {
        one
        for hole in (*plan.windows, *plan.doors)
        for one, other in (hole.rooms, hole.rooms[::-1])
        if other in outdoors and (hole.kind == "window" or other is not None or hole.width >= LIGHT_M)
    }
    wide = [door.rooms for door in plan.doors if door.width >= LIGHT_M]
    lit |= {room for rooms in wide if lit.intersection(rooms) for room in rooms}
    return {room: room in lit for room, kind in types.items() if kind in HABITABLE}


def _with_furniture(room: Room, objects: Iterable[PlanObject]) -> Polygon:
    """Return a room with the furniture that is cut out of it; one that is no single polygon then as it is."""
    import shapely

    whole = room.with_furniture(objects)
    return whole if isinstance(whole, shapely.Polygon) else room.polygon


def largest_circle_diameter(shape: Polygon) -> float:
    """Return the diameter of the largest circle inside a polygon, metres, at most 0.01 m too small.

    The circle is found by the method of the pole of inaccessibility (V. Agafonkin, "polylabel", 2016; GEOS).
    """
    import shapely

    return 2.0 * float(shapely.maximum_inscribed_circle(shape, tolerance=_CIRCLE_M).length)


_CIRCLE_M: Final = 0.005
"""The error of an inscribed circle's radius, metres; a tenth of it takes six times as long."""


def aspect_ratio(shape: Polygon) -> float:
    """Return the ratio of the longer to the shorter side of the smallest rotated rectangle round a polygon."""
    import shapely

    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shape))
    short, long = sorted(np.hypot(*(corners[1:3] - corners[:2]).T).tolist())
    return float(long / short)


def _audit_room(room: Room, shape: Polygon, is_lit: bool | None) -> AuditedRoom:
    kind, width = TYPES.get(room.label, "other"), largest_circle_diameter(shape)
    return AuditedRoom(room.id, kind, round(shape.area, 3), round(width, 3), round(aspect_ratio(shape), 3), is_lit)


def _hole_share(covered: Polygon | MultiPolygon) -> float:
    """Return the share of the footprint that is enclosed and wider than a wall (R2)."""
    import shapely

    grown = shapely.buffer(covered, BETWEEN_ROOMS_M / 2, join_style="mitre")
    if not any(part.interiors for part in shapely.get_parts(grown)):
        return 0.0
    closed = shapely.buffer(grown, -BETWEEN_ROOMS_M / 2, join_style="mitre")
    footprint = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(closed)])
    return max(0.0, 1.0 - float(closed.area / footprint.area))


def _adjoining(shapes: list[Polygon]) -> list[tuple[int, int]]:
    """Return the pairs of rooms that share a wall (R3).

    Rooms that are grown by half a wall overlap, along a wall that they share, in a strip of a wall's width.
    """
    import shapely

    grown = shapely.buffer(shapes, BETWEEN_ROOMS_M / 2)
    one, other = shapely.STRtree(grown).query(grown, predicate="intersects")
    one, other = one[one < other], other[one < other]
    shared = shapely.area(shapely.intersection(grown[one], grown[other])) / BETWEEN_ROOMS_M
    return sorted(zip(one[shared >= SHARED_WALL_M].tolist(), other[shared >= SHARED_WALL_M].tolist(), strict=True))


def _pieces(count: int, pairs: list[tuple[int, int]]) -> int:
    import networkx as nx

    graph = nx.Graph(pairs)
    graph.add_nodes_from(range(count))
    return int(nx.number_connected_components(graph))
