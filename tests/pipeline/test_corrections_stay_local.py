"""A single correction changes what it touches and nothing else, in houses of all kinds; the rest is where it was.

Words act on the finished plan with what the source shows (``houseexpo.corrections``), so that a house is read once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon

from houseexpo.corrections import Override
from houseexpo.corrections.apply import Corrected
from houseexpo.corrections.vocabulary import WORDS
from houseexpo.dataset.validation import BOTH, OURS
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan import Door, Room
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_level, run_stages
from pipeline.batch.job import level_rng
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.stages.corrections import correct
from pipeline.values import Evidence, Layout, Level, Spaces
from tests.builders.drawn import changed_shapes, doors_beside, in_source, walls_without_door
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.shared import DATA, needs_shared
from tests.builders.suncg_houses import write_houses

MOST_WORDS = 2
"""Of one kind in one plan."""
FAR_M = 9e3
Said = tuple[str, Any, Polygon]
"""A word, its value, and the area that it touches, in the source's axes."""


@dataclass(frozen=True, eq=False)
class House:
    """A plan without corrections, and what its source shows."""

    level: Level
    plan: FloorPlan
    found: tuple[Evidence, Layout]
    unreached: tuple[Polygon, ...]

    def corrected(self, word: str, value: Any) -> Corrected[FloorPlan]:
        return correct(self.level, Override(**{word: value}).corrections, self.found, self.unreached, self.plan)


def houses(source: str) -> Iterator[House]:
    for item in find(source):
        with suppress(Rejection):
            for level in reader(item.reader).read(item):
                if isinstance(level, Level):
                    yield from _houses_of(level)


def _houses_of(level: Level) -> Iterator[House]:
    stages: list[Any] = []
    with suppress(Rejection):
        stages += [each.value for each in run_stages(level, PipelineConfig(), level_rng(level, 0))]
    first: dict[Any, Any] = {type(each): each for each in reversed(stages)}
    for plan in (each for each in stages if isinstance(each, FloorPlan)):
        plain = replace(plan, navigability={})  # it is not measured then
        yield House(level, plain, (first[Evidence], first[Layout]), first[Spaces].rooms)


def check(house: House, word: str, value: Any, touched: Polygon) -> str:
    """Correct a plan; what is not within the touched area, and is not told, is as it was. Return the outcome."""
    before, found = house.plan, house.corrected(word, value)
    (effect,), after = found.effects, found.plan
    place = f"{before.id}: {word} = {value}: {effect.sentence}"
    if effect.outcome != "done":
        assert not changed_shapes(before, after), place
        return effect.outcome
    assert encode(after) != encode(before), place
    assert encode(decode(encode(after))) == encode(after), place
    assert broken_rules(after) <= broken_rules(before), place
    if not (effect.also or found.followed):
        assert all(shape.intersects(touched) for shape in changed_shapes(before, after)), place
    return "done"


def broken_rules(plan: FloorPlan) -> set[str]:
    found = {f"{name} {key.partition('[')[0]}" for name, rule in {**BOTH, **OURS}.items() for key, _ in rule(plan)}
    return found | (set() if Polygon(plan.verts, plan.holes).is_valid else {"simple verts"})


def words_of(plan: FloorPlan, most: int) -> Iterator[Said]:
    """Yield single corrections of a plan, all words of the vocabulary that it has a place for."""
    for line, one, other in islice(walls_without_door(plan), most):
        drawn = in_source(plan, line)
        beside = [*doors_beside(plan, one), *doors_beside(plan, other)]
        yield from ((word, drawn, LineString(drawn).buffer(0.6)) for word in ("door", "opening"))
        yield "no_wall", drawn, area_of(plan, (one, other, *beside), 0.05)
    for room in plan.rooms[:most]:
        yield from _words_of_room(plan, room)
    for door in plan.doors[:most]:
        (place,) = in_source(plan, [middle_of(door)])
        yield from ((word, place, area_of(plan, (door,), 0.05)) for word in ("no_door", "window"))
        if None not in door.rooms and door.rooms[0] != door.rooms[1]:
            pair = [room for room in plan.rooms if room.id in door.rooms]
            ways = [each for each in plan.doors if set(each.rooms) == set(door.rooms)]
            yield "one_room", in_source(plan, [middle_of(room) for room in pair]), area_of(plan, (*pair, *ways), 0.4)


def _words_of_room(plan: FloorPlan, room: Room) -> Iterator[Said]:
    x, y = middle_of(room)
    (place,), own = in_source(plan, [(x, y)]), area_of(plan, (room, *doors_beside(plan, room)), 0.05)
    yield "label", (*place, "Gym"), Polygon()
    yield "no_room", place, own
    yield "outside", place, own.buffer(0.3)
    x1, y1, x2, y2 = room.polygon.bounds
    for across in (LineString([(x, y1), (x, y2)]), LineString([(x1, y), (x2, y)])):
        inside = shapely.get_parts(shapely.intersection(across, room.polygon))
        (line,) = (part for part in inside if part.distance(Point(x, y)) < 0.01)
        yield from ((word, in_source(plan, line.coords), own) for word in ("wall", "opening"))
    for far_m in (-0.6, 0.6):
        dragged = Polygon(in_source(plan, _with_longest_edge_moved(room.ring, far_m)))
        if dragged.is_valid:
            yield "room_outline", list(dragged.exterior.coords)[:-1], shapely.union(dragged, own).buffer(0.5)
    for a, b in zip(room.ring, np.roll(room.ring, -1, axis=0), strict=True):
        middle, along = (a + b) / 2, (b - a) / math.dist(a, b)
        beside = Point(middle + 0.5 * np.array([-along[1], along[0]]))  # rings run clockwise
        if math.dist(a, b) > 1.4 and all(each.polygon.distance(beside) > 0.6 for each in plan.rooms if each != room):
            drawn = in_source(plan, [middle - 0.45 * along, middle + 0.45 * along])
            yield "entrance", drawn, LineString(drawn).buffer(0.6)
            return


def _with_longest_edge_moved(ring: np.ndarray[Any, Any], far_m: float) -> np.ndarray[Any, Any]:
    """Return a room's ring as it is when a person drags its longest edge."""
    edges = np.roll(ring, -1, axis=0) - ring
    k = int(np.hypot(*edges.T).argmax())
    out = np.array([-edges[k][1], edges[k][0]]) / np.hypot(*edges[k]) * far_m
    ring = np.roll(ring, -k, axis=0)
    return np.vstack([ring[:1], ring[:2] + out, ring[1:]])


def middle_of(part: Room | Door) -> tuple[float, float]:
    found: tuple[float, float] = part.polygon.representative_point().coords[0]
    return found


def area_of(plan: FloorPlan, parts: Sequence[Room | Door], more_m: float) -> Polygon:
    return shapely.union_all([Polygon(in_source(plan, part.ring)) for part in parts]).buffer(more_m)


def check_plan(house: House, most: int = MOST_WORDS) -> list[str]:
    """Say all words of a plan, one at a time, and one of each form far away; return the words that had an effect."""
    for word, form in FAR.items():
        (far,) = house.corrected(word, form).effects
        assert far.outcome == "none", far
    return [word for word, value, touched in words_of(house.plan, most) if check(house, word, value, touched) == "done"]


FAR: dict[str, Any] = {
    **dict.fromkeys(("door", "opening", "entrance", "wall", "no_wall"), ((FAR_M, FAR_M), (FAR_M, FAR_M + 1))),
    **dict.fromkeys(("no_room", "outside", "window", "no_door", "room"), (FAR_M, FAR_M)),
    "label": (FAR_M, FAR_M, "Gym"),
    "one_room": ((FAR_M, FAR_M), (FAR_M, FAR_M + 9)),
}
"""A word of each form, 9 km away."""


@pytest.mark.slow
def test_all_words_of_made_homes_have_an_effect_and_that_of_a_build(tmp_path: Path) -> None:
    done: list[str] = []
    for house in houses("procedural:4?style=published"):
        done += check_plan(house)
    assert set(done) == set(WORDS) - {"room"}  # no space is left out
    assert done.count("door") >= 4
    (house,) = houses("procedural:1?style=published")
    word, value, _ = next(each for each in words_of(house.plan, 1) if each[0] == "door")
    said = Override(**{word: value})
    (built,) = plan_level(
        replace(house.level, corrections=said.corrections), PipelineConfig(), level_rng(house.level, 0)
    )
    assert isinstance(built, FloorPlan)
    assert not changed_shapes(house.corrected(word, value).plan, built)


@pytest.mark.slow
def test_corrections_of_houses_with_hard_cases_stay_local(tmp_path: Path) -> None:
    write_houses(tmp_path, 20, 0)
    assert sum(len(check_plan(house)) for house in houses(str(tmp_path))) > 100


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, *RAW])
def test_corrections_of_each_kind_stay_local(kind: str, tmp_path: Path) -> None:
    for house in houses(str(make_member(kind, 0, 3, tmp_path).path)):
        check_plan(house)


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("file", sorted(p.name for p in (DATA / "found").glob("*") if p.suffix != ".pgm"))
def test_corrections_of_found_files_stay_local(file: str) -> None:
    for house in houses(str(DATA / "found" / file)):
        check_plan(house)
