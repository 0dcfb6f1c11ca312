"""Choose for each door of a plan how its leaf hangs, and return the lines that show it.

A plan records where a door is, not which way it opens. The choice follows what builders do:

D1  A door of up to 1.25 m has one leaf, a door of up to 2.4 m two. A wider door, an ``opening`` or a ``cut`` has no
    leaf.
D2  A leaf opens where its swing is free of walls, furniture and the swings of other leaves; doors are hung again until
    none would hang otherwise beside the others.
D3  A leaf opens into a room rather than into a passage or outdoors; of two equal rooms, into the smaller room.
D4  The opened leaf stands against a wall.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.plan import Door, Room
from houseexpo.plan.model import PlanData
from houseexpo.tolerances import ENTRANCE_TOUCH_M

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

Points = npt.NDArray[np.float64]

_ONE_LEAF_M: Final = 1.25  # widths of single doors end at 1.1 m, of double doors they begin at 1.3 m
_TWO_LEAVES_M: Final = 2.4
_LOOKS: Final = (0.1, 0.5, 0.9)  # places along a window at which its wall is measured
_ARC_STEPS: Final = 10  # of an arc; a chord is within 1% of the radius
_AT_M: Final = 0.02  # a room this close to the wall's face begins there
_FREE_SWING: Final = 0.94  # the least free share of the swing: walls are drawn on a grid of 1 cm
_PASSAGES: Final = frozenset({"Hallway", "Hall", "Lobby", "Entryway"})
OUTDOORS: Final = frozenset({"Balcony", "Terrace", "Loggia"})
_WEIGHT: Final = 8.0  # of a free swing, against a liking of about 1
_ROUNDS: Final = 6  # nearly all plans are settled after three
_CUPBOARD_M2: Final = 1.5  # in a smaller room a person and a leaf do not fit


@dataclass(frozen=True)
class Leaf:
    """A door leaf: hinge (2,), the end of the opened leaf (2,), and the arc (n, 2) from there to the closed end."""

    hinge: Points
    end: Points
    arc: Points

    @property
    def swing(self) -> Polygon:
        """The floor over which the leaf turns, metres."""
        from shapely import Polygon

        return Polygon([self.hinge, *self.arc])


@dataclass(frozen=True)
class _Way:
    """One way to hang a door: its leaves, and its score."""

    leaves: tuple[Leaf, ...]
    room: int
    liked: float


def door_leaves(plan: PlanData) -> dict[int, tuple[Leaf, ...]]:
    """Return the leaves of each door by the door's id; doors without a leaf are missing."""
    import shapely

    rooms = {room.id: (room, valid_shape(room.polygon)) for room in plan.rooms}
    doors = {door.id: ways for door in plan.doors if has_leaf(door) and (ways := list(_ways(door, rooms)))}
    furniture = shapely.union_all([valid_shape(thing.polygon) for thing in plan.objects])
    floors = {name: shapely.union(shape, furniture) for name, (_, shape) in rooms.items()}
    hangs = [_Hang(ways, floors, furniture) for ways in doors.values()]
    tree = shapely.STRtree([hang.reach for hang in hangs])
    beside = [sorted({*tree.query(hang.reach).tolist()} - {k}) for k, hang in enumerate(hangs)]
    for _ in range(_ROUNDS):  # of the first, each door sees those before it; of the others, all
        before = [hang.best for hang in hangs]
        for hang, others in zip(hangs, beside, strict=True):
            hang.choose([hangs[k].swings[best] for k in others if (best := hangs[k].best) is not None])
        if [hang.best for hang in hangs] == before:
            break
    return {name: ways[hang.best or 0].leaves for (name, ways), hang in zip(doors.items(), hangs, strict=True)}


class _Hang:
    """The ways to hang a door, the floor over which its leaves turn in each, and the best of them so far."""

    def __init__(self, ways: Sequence[_Way], floors: Mapping[int, BaseGeometry], furniture: BaseGeometry) -> None:
        import shapely

        self.swings: list[BaseGeometry] = [shapely.union_all([leaf.swing for leaf in way.leaves]) for way in ways]
        self.reach = shapely.union_all(self.swings)
        self.best: int | None = None
        self._areas = shapely.area(self.swings)
        free = shapely.area(shapely.intersection(self.swings, [floors[way.room] for way in ways])) / self._areas
        self._liked = _WEIGHT * np.minimum(free / _FREE_SWING, 1.0) + [way.liked for way in ways]  # D3, D4
        self._liked -= self._share(furniture)

    def choose(self, others: Sequence[BaseGeometry]) -> None:
        """Choose the best way beside the swings of other doors (D2)."""
        self.best = int(np.argmax(self._liked - sum(map(self._share, others))))

    def _share(self, taken: BaseGeometry) -> Points:
        """Return what counts against each way where its swing meets something (D2)."""
        import shapely

        shares: Points = shapely.area(shapely.intersection(self.swings, taken)) / self._areas
        return _WEIGHT * shares


def has_leaf(door: Door) -> bool:
    """Return whether a door is drawn with a leaf (D1)."""
    return door.kind in {"door", "entrance"} and 0 < door.width <= _TWO_LEAVES_M


def window_in_walls(window: Door, walls: BaseGeometry, beyond_m: float) -> Polygon | None:
    """Return a window between the faces of its wall as it is drawn, where it is thinnest; None where none stands.

    ``beyond_m`` is how far beyond the faces of the plan the drawn wall may reach.
    """
    import shapely

    start, along, across = _axes(window)
    low, high = _faces(window, start, across)
    width = along * math.dist(*window.segment)
    faces = []
    for at in (start + share * width for share in _LOOKS):
        look = shapely.LineString([at + (low - beyond_m) * across, at + (high + beyond_m) * across])
        parts = shapely.get_parts(shapely.intersection(walls, look))
        own = [part for part in parts if part.length > 0 and shapely.dwithin(part, window.polygon, ENTRANCE_TOUCH_M)]
        depths = (shapely.get_coordinates(own) - start) @ across
        faces += [(float(depths.min()), float(depths.max()))] if own else []
    low, high = max((face[0] for face in faces), default=0.0), min((face[1] for face in faces), default=0.0)
    if low >= high:
        return None
    one, other = start + low * across, start + high * across
    return shapely.Polygon([one, one + width, other + width, other])


def entrance_gap(door: Door, beyond_m: float) -> Polygon:
    """Return a strip across the wall at a door, metres: from jamb to jamb, and ``beyond_m`` beyond the wall's faces."""
    import shapely

    start, along, across = _axes(door)
    low, high = _faces(door, start, across)
    width = along * math.dist(*door.segment)
    one, other = start + (low - beyond_m) * across, start + (high + beyond_m) * across
    return shapely.Polygon([one, one + width, other + width, other])


def _ways(door: Door, rooms: Mapping[int, tuple[Room, BaseGeometry]]) -> Iterator[_Way]:
    """Yield the ways to hang a door: both sides, and for one leaf both hinges."""
    import shapely

    start, along, across = _axes(door)
    width = math.dist(*door.segment)
    low, high = _faces(door, start, across)
    beside = [rooms[i] for i in door.rooms if i is not None and i in rooms]
    for side, face in ((-1.0, low), (1.0, high)):
        jamb = start + face * across
        middle = shapely.Point(jamb + along * (width / 2) + 0.05 * side * across)
        room, floor = next((each for each in beside if float(each[1].distance(middle)) < _AT_M), (None, None))
        if room is None or floor is None:
            continue
        into = side * across
        if width > _ONE_LEAF_M:
            both = (_leaf(jamb, along, into, width / 2), _leaf(jamb + along * width, -along, into, width / 2))
            yield _Way(both, room.id, _liking(room))
            continue
        for hinge, closed in ((jamb, along), (jamb + along * width, -along)):
            leaf = _leaf(hinge, closed, into, width)
            middle = shapely.Point((leaf.hinge + leaf.end) / 2)
            away = float(floor.boundary.distance(middle))
            yield _Way((leaf,), room.id, _liking(room) + 0.5 / (1 + away / 0.3))  # D4


def valid_shape(shape: Polygon) -> BaseGeometry:
    """Return a room as a valid shape; in a file, a room may cross itself."""
    import shapely

    return shape if shape.is_valid else shapely.make_valid(shape)


def _liking(room: Room) -> float:
    """Return how well a leaf stands in a room (D3): 1 in a room, less in passages, outdoors and cupboards."""
    if room.label in OUTDOORS or room.area < _CUPBOARD_M2:
        return -0.5
    return (0.0 if room.label in _PASSAGES else 1.0) - 0.1 * min(room.area / 50, 1)


def _leaf(hinge: Points, closed: Points, into: Points, width: float) -> Leaf:
    angles = np.linspace(0, math.pi / 2, _ARC_STEPS + 1)[:, None]
    arc = hinge + width * (np.sin(angles) * closed + np.cos(angles) * into)
    return Leaf(hinge, arc[0], arc)


def _axes(door: Door) -> tuple[Points, Points, Points]:
    """Return a door's first jamb, the direction along it and that across it."""
    start, end = np.asarray(door.segment, dtype=np.float64)
    along = (end - start) / max(math.dist(start, end), 1e-9)
    return start, along, np.array([-along[1], along[0]])


def _faces(door: Door, start: Points, across: Points) -> tuple[float, float]:
    """Return where the two faces of the wall are, metres from the segment along ``across``."""
    offsets = (door.ring - start) @ across
    return min(float(offsets.min()), 0.0), max(float(offsets.max()), 0.0)
