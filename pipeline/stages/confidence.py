"""Rate each door, entrance and room of a plan with a probability, 0 to 1, by three logistic models of named features.

The confidence of a door is the probability that a passage is there; that of a room is the probability that its outline
is right. The models (``stages.logistic``) are fitted by ``python -m research.weights_fit`` on made houses and on
houses whose rooms and doors people have drawn or marked, so no weight is set by hand.

F1  Every feature is between 0 and 1, and 0 where nothing is special.
F2  What closes the place weighs most: a known doorway, a lintel, a sill, a gap, a mouth, or a wall that had to be cut.
F3  The shape of a passage: too narrow, too wide, too deep, an end without a wall, a leaf beside it, a second passage
    between the same two rooms, furniture or no floor in front of it.
F4  The shape of a room: too small, narrow or ragged, a wall that ends in it, its edge open or taken from the floor,
    no floor under it, nothing that leads into it but cuts, no agreement with the room that the source draws; and the
    doubt whether it is a room of the house at all (``doubtful_space``, ``stages.room_doubt``).
F5  The grounds of the whole plan (``stages.quality_grounds``): the doors and rooms of a doubtful plan are doubtful. Too
    few rooms and entrances are known to be false to fit a weight for each ground; their one feature is the plan's
    quality, ``doubtful_plan``.
F6  For an entrance also: whether something stands in it a hand's breadth above the floor (``barred``: the foot of a
    window, a parapet; not the closed leaf of a door that the source names); how many other ways out its room has
    (windows come in rows); whether it is the only way into its room; and, in an upper storey (``upper``), whether
    neither a floor nor the ground lies before it (``air_before``).

F7  An entrance with a confidence below ``MOST`` (a window that reaches the floor, a niche) is left out, unless the
    source names it, if another entrance of the building is sure. If none is sure, it is left out only if no door is
    known there and it is narrower than a person's shoulders.

A house whose doors are closed by sills (``Level.sills``: SUNCG and the homes that the project makes) gets no
confidence: its source marks each door.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.plan.parts import SURE
from pipeline.geometry.areas import EMPTY, OUTSIDE, Shapes, overlaps, shares_of_places, unite
from pipeline.geometry.mesh_slicing import barred_shares
from pipeline.geometry.openings import EDGES, GAPS, KNOWN, Opening, end_at_walls, strips_before, strips_of
from pipeline.geometry.prisms import Prisms
from pipeline.geometry.room_shapes import are_rooms_misshapen, have_jutting_walls
from pipeline.quality import doubt_plan
from pipeline.stages.connectivity import NO_EVIDENCE, NO_WALL, UNKNOWN
from pipeline.stages.logistic import Models, load_models
from pipeline.stages.quality_grounds import shares_without_floor
from pipeline.stages.room_doubt import of_rooms
from pipeline.tolerances import BESIDE_M, HAND_M, MOST, SHEET_M, SHOULDERS_M
from pipeline.values import Evidence, Layout, Level, NamedRoom, Spaces

Part: TypeAlias = Literal["door", "entrance", "room"]
Features: TypeAlias = dict[str, float]
Floats: TypeAlias = npt.NDArray[np.float64]

NARROW_M: Final = (0.7, 0.35)
"""A ramp, used in the same form below: a width below the first is narrow, and wholly so if less by the second."""
WIDE_M: Final = (1.1, 1.5)
DEEP_PASSAGE_M: Final = (0.35, 0.6)
SMALL_ROOM_M2: Final = (4.0, 3.0)
LARGE_ROOM_M2: Final = (40.0, 120.0)
CROWD: Final = (3, 6)
"""Passages of a room: more than the first are many."""


@dataclass(frozen=True, eq=False)
class FinalBuilding:
    """A building whose rooms and passages are final: what the stages found, and the ``grounds`` against its plan.

    ``doubts`` (n,) say how doubtful each of the layout's spaces is (``stages.room_doubt``). ``models`` rate the parts.
    """

    level: Level
    evidence: Evidence
    layout: Layout
    spaces: Spaces
    named: tuple[NamedRoom, ...]
    grounds: Mapping[str, float]
    doubts: Floats
    models: Models = field(default_factory=load_models)

    @cached_property
    def features(self) -> Features:
        """The grounds of the plan, and how doubtful they make it by the model of its kind, as features (F5)."""
        doubt = doubt_plan(self.grounds, marked=self.level.sills)
        return {**{f"plan_{name}": float(value) for name, value in self.grounds.items()}, "doubtful_plan": doubt}


def add_confidences(planned: FinalBuilding) -> FinalBuilding:
    """Return a building with the confidence of its passages and rooms; a house with sills is returned as it is."""
    if planned.level.sills:
        return planned
    doors = zip(planned.spaces.passages, passage_features(planned), strict=True)
    passages = tuple(
        replace(p, confidence=planned.models[model_for_passage(p)].confidence(features)) for p, features in doors
    )
    rooms = zip(planned.named, room_features(planned), strict=True)
    named = tuple(replace(room, confidence=planned.models["room"].confidence(features)) for room, features in rooms)
    return replace(planned, spaces=replace(planned.spaces, passages=passages), named=named)


def without_unlikely_entrances(planned: FinalBuilding) -> FinalBuilding:
    """Return a rated building without its unlikely entrances, which a note counts (F7)."""
    spaces = planned.spaces
    outer = {k: p.confidence for k, p in enumerate(spaces.passages) if p.leads_outside and p.confidence is not None}
    named = planned.level.named_openings
    gone = {k for k, sure in outer.items() if sure < MOST and not (named and spaces.passages[k].closed_by in KNOWN)}
    if gone and max(outer.values()) < SURE:
        doorless = {k for k in gone if spaces.passages[k].closed_by not in KNOWN}
        gone = {k for k in doorless if spaces.passages[k].width < SHOULDERS_M}
    if not gone:
        return planned
    passages = tuple(p for k, p in enumerate(spaces.passages) if k not in gone)
    notes = {**spaces.notes, "unlikely_entrances": len(gone)}
    return replace(planned, spaces=replace(spaces, passages=passages, notes=notes))


def model_for_passage(passage: Opening) -> Part:
    """Return the name of the model that rates a passage."""
    return "entrance" if passage.leads_outside else "door"


def passage_features(planned: FinalBuilding) -> list[Features]:
    """Return the features of each passage, in the order of the passages (F2, F3, F5)."""
    level, evidence, layout, spaces = planned.level, planned.evidence, planned.layout, planned.spaces
    rooms, passages = spaces.rooms, spaces.passages
    room_is_odd, jutting = are_rooms_misshapen(rooms), have_jutting_walls(rooms)
    strips = strips_of(passages if evidence.leaves else [])  # a drawing has none
    beside_leaf = shapely.STRtree(evidence.leaves).query(strips, predicate="dwithin", distance=BESIDE_M)
    pairs = [frozenset(passage.sides) for passage in passages]
    ways = [sum(side in pair for pair in pairs) for side in range(len(rooms))]
    inner = [(k, side) for k, passage in enumerate(passages) for side in (0, 1) if passage.sides[side] != OUTSIDE]
    of_passage = np.array([k for k, _ in inner], np.int64)
    fronts = strips_before([passages[k] for k, _ in inner], [2 * side - 1 for _, side in inner], SHOULDERS_M)
    floor = level.floor_with_rooms
    bare = np.zeros(len(fronts)) if floor is None else 1.0 - shares_of_places(fronts, floor)
    blocked, floorless = (
        _most_of_each(of_passage, shares, len(passages))
        for shares in (shares_of_places(fronts, evidence.furniture), bare)
    )
    at_walls = end_at_walls(passages, layout.door)
    of_entrances, found = _of_entrances(planned), []
    for k, passage in enumerate(passages):
        within = [side for side in passage.sides if side != OUTSIDE]
        known = passage.closed_by in KNOWN
        found.append(
            {
                **_kind(passage, known=known, named=level.named_openings),
                "leaf": float((beside_leaf[0] == k).any()),
                "narrow": _ramp(NARROW_M[0] - passage.width, NARROW_M[1]),
                "wide": _ramp(passage.width - WIDE_M[0], WIDE_M[1]),
                "deep": _ramp(passage.depth - DEEP_PASSAGE_M[0], DEEP_PASSAGE_M[1]),
                "loose_end": float(not at_walls[k]),
                "twin": float(pairs.count(pairs[k]) > 1 and not passage.leads_outside),
                "blocked": float(blocked[k]),
                "floorless": float(floorless[k]),
                "odd_room": float(room_is_odd[within].any()),
                "jutting_wall": float(jutting[within].any()),
                "crowded": max(_ramp(ways[side] - CROWD[0], CROWD[1]) for side in within),
                "scanned": float(evidence.scanned),
                **of_entrances.get(k, {}),
                **planned.features,
            }
        )
    return found


def _most_of_each(of_passage: npt.NDArray[np.int64], shares: Floats, count: int) -> Floats:
    """Return for each passage the larger of the shares (m,) of its fronts; 0 where it has none."""
    found = np.zeros(count)
    np.maximum.at(found, of_passage, shares)
    return found


def _of_entrances(planned: FinalBuilding) -> dict[int, Features]:
    """Return the features that only entrances have, by the index of the passage (F6)."""
    level, passages = planned.level, planned.spaces.passages
    found: dict[int, Features] = {}
    outer = [k for k, passage in enumerate(passages) if passage.leads_outside]
    barred = _barred_shares([passages[k] for k in outer], level, scanned=planned.evidence.scanned)
    upper = level.below is not None
    for k, bar in zip(outer, barred, strict=True):
        opening = passages[k]
        room, side = (opening.sides[0], 1) if opening.sides[1] == OUTSIDE else (opening.sides[1], -1)
        others = [p for j, p in enumerate(passages) if room in p.sides and j != k]
        found[k] = {
            "barred": 0.0 if level.named_openings and passages[k].closed_by == "door" else bar,
            "other_ways_out": _ramp(sum(p.leads_outside for p in others), 3),  # more say no more
            "only_way": float(all(p.kind == "cut" for p in others)),
            "upper": float(upper),
            "air_before": _air_before(opening, side, level) if upper and level.floor is not None else 0.0,
        }
    return found


def _air_before(opening: Opening, side: int, level: Level) -> float:
    """Return the share of the place before one side of an entrance where there is neither floor nor ground (F6)."""
    before = strips_before([opening], [side], SHOULDERS_M)
    return 1.0 - max(float(shares_of_places(before, what or EMPTY)[0]) for what in (level.floor, level.below))


def _barred_shares(openings: Sequence[Opening], level: Level, *, scanned: bool) -> Sequence[float]:
    """Return the share of each opening's width (n,) in which something stands that one has to step over (F6)."""
    if isinstance(level.walls, Prisms) or level.walls.is_cloud or scanned or not openings:
        return [0.0] * len(openings)
    between_jambs = [opening.strip(deeper_m=HAND_M, wider_m=-SHEET_M) for opening in openings]
    shares = barred_shares(level.walls, HAND_M, between_jambs, np.array([opening.along for opening in openings]))
    return np.round(shares, 4).tolist()  # type: ignore[no-any-return]


def room_features(planned: FinalBuilding) -> list[Features]:
    """Return the features of each named room, in their order (F4, F5)."""
    level, evidence, layout, spaces = planned.level, planned.evidence, planned.layout, planned.spaces
    rooms = [each.polygon for each in planned.named]
    if not rooms:
        return []
    is_odd, jutting = are_rooms_misshapen(tuple(rooms)), have_jutting_walls(tuple(rooms))
    places = np.array(rooms, np.object_)
    edges = shapely.get_exterior_ring(shapely.buffer(places, SHEET_M))
    given = _shares_along(edges, [c.polygon for c in layout.candidates if c.closed_by in EDGES])
    patches = _shares_along(
        edges, [c.polygon for c in layout.candidates if not c.is_strip and c.closed_by not in EDGES]
    )
    mouths = _shares_along(edges, [c.polygon for c in layout.candidates if c.closed_by == "mouth"])
    walled = _shares_along(edges, [layout.ground])
    drawn = [room.polygon for room in level.rooms if room.polygon is not None]
    home = shapely.STRtree(spaces.rooms).nearest(shapely.point_on_surface(places))
    floorless, filled = shares_without_floor(level, rooms), shares_of_places(places, evidence.furniture)
    doubts = of_rooms(layout, planned.doubts, rooms)
    unlike = 1.0 - overlaps(tuple(rooms), tuple(drawn)).max(axis=1) if drawn else np.zeros(len(rooms))
    found = []
    for k, (room, its) in enumerate(zip(rooms, home.tolist(), strict=True)):
        ways = [p for p in spaces.passages if its in p.sides]
        found.append(
            {
                "small": _ramp(SMALL_ROOM_M2[0] - room.area, SMALL_ROOM_M2[1]),
                "large": _ramp(room.area - LARGE_ROOM_M2[0], LARGE_ROOM_M2[1]),
                "odd": float(is_odd[k]),
                "jutting_wall": float(jutting[k]),
                "given_edge": float(given[k]),
                "patched_edge": float(patches[k]),
                "mouth": float(mouths[k]),
                "wallless_edge": 1.0 - float(walled[k]),
                "floorless": float(floorless[k]),
                "drawn": float(bool(drawn)),
                "unlike_drawn": float(unlike[k]),
                "closed": float(not ways),
                "only_cuts": float(bool(ways) and all(p.kind == "cut" for p in ways)),
                "furnished": float(filled[k] > 0.02),
                "scanned": float(evidence.scanned),
                "alone": float(len(rooms) == 1),
                "doubtful_space": float(doubts[k]),
                **planned.features,
            }
        )
    return found


def _kind(passage: Opening, *, known: bool, named: bool) -> Features:
    """Return the features of what closes the place of a passage (F2)."""
    cut = passage.kind == "cut"
    return {
        "known": float(known),
        "named": float(known and named),
        "lintel": float(passage.closed_by == "lintel"),
        "sill": float(passage.closed_by == "sill"),
        "gap": float(passage.closed_by in GAPS and passage.closed_by != "mouth"),
        "mouth": float(passage.closed_by == "mouth"),
        "cut": float(cut),
        "bare_cut": float(cut and passage.why in {NO_EVIDENCE, NO_WALL}),
        "unknown_cut": float(cut and passage.why == UNKNOWN),
    }


def _shares_along(edges: Shapes, what: Sequence[BaseGeometry]) -> Floats:
    """Return the share of each edge (n,) that runs along some areas."""
    area = unite(what) if len(what) > 1 else what[0] if what else EMPTY
    if area.is_empty:
        return np.zeros(len(edges))
    shapely.prepare(area)
    found = shapely.covers(area, edges).astype(np.float64)
    rest = found == 0.0
    found[rest] = shapely.length(shapely.intersection(edges[rest], area)) / shapely.length(edges[rest])
    return np.asarray(found)


def _ramp(more: float, whole: float) -> float:
    return float(min(max(more / whole, 0.0), 1.0))
