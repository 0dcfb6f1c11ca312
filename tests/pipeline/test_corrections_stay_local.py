"""A single correction changes what it touches and nothing else, in houses of all kinds; the rest is where it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from shapely import LineString, Polygon

from houseexpo.corrections import Override
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_level
from pipeline.batch.job import level_rng
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level
from tests.builders.drawn import changed_shapes, doors_beside, in_source, walls_without_door
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.shared import DATA, needs_shared
from tests.builders.suncg_houses import write_houses

MOST_WORDS = 3  # of one kind in one plan: each is planned anew


def levels(source: str) -> Iterator[Level]:
    for item in find(source):
        for level in reader(item.reader).read(item):
            if isinstance(level, Level):
                yield level


def planned(level: Level, said: Override | None = None) -> list[FloorPlan]:
    corrected = replace(level, corrections=said.corrections) if said else level
    return [
        each for each in plan_level(corrected, PipelineConfig(), level_rng(level, 0)) if isinstance(each, FloorPlan)
    ]


def records(plan: FloorPlan) -> list[dict[str, str]]:
    return list((plan.provenance or {}).get("corrections", []))


def check(level: Level, before: FloorPlan, said: Override, touched: Polygon) -> FloorPlan:
    """Plan a level with one correction; what is not within the touched area (source's axes) is as it was."""
    after = next(each for each in planned(level, said) if each.id == before.id)
    decode(encode(after))
    (record,) = records(after)
    assert record["outcome"] == "done", record
    followed = (after.provenance or {}).get("followed", [])
    cuts = [Polygon(in_source(before, door.ring)) for door in before.doors if door.kind == "cut"]
    needless = cuts if any("not needed any more" in each for each in followed) else []  # it says so
    beyond = [
        shape
        for shape in changed_shapes(before, after)
        if not shape.intersects(touched) and all(shapely.hausdorff_distance(shape, cut) > 0.011 for cut in needless)
    ]
    assert not beyond, (said, record, beyond)
    assert encode(after) == encode(next(each for each in planned(level, said) if each.id == before.id))
    return after


def check_level(level: Level, most: int = MOST_WORDS) -> int:
    """Draw doors, take rooms out, part and name them, one at a time; return the number of doors that were drawn."""
    count = 0
    for before in planned(level):
        for line, one, other in list(walls_without_door(before))[:most]:
            drawn = in_source(before, line)
            touched = LineString(drawn).buffer(0.6)
            after = check(level, before, Override(door=drawn), touched)
            assert len(after.rooms) == len(before.rooms)
            new = [door for door in after.doors if door.confidence == 1.0 and door.kind == "door"]
            middle = LineString(drawn).centroid
            at = [door for door in new if Polygon(in_source(after, door.ring)).distance(middle) < 0.05]
            assert len(at) == 1, (one, other, new)
            count += 1
        for room in before.rooms[:most] if len(before.rooms) > 2 else ():
            place = in_source(before, [room.polygon.representative_point().coords[0]])[0]
            area = Polygon(in_source(before, room.ring))
            around = [area, *(Polygon(in_source(before, door.ring)) for door in doors_beside(before, room))]
            after = next(each for each in planned(level, Override(no_room=place)) if each.id == before.id)
            followed = (after.provenance or {}).get("followed", [])
            if not followed:  # a cut, or rooms left out, that it says itself
                check(level, before, Override(no_room=place), shapely.union_all(around).buffer(0.05))
                assert len(after.rooms) == len(before.rooms) - 1
            named = check(level, before, Override(label=(*place, "Gym")), Polygon())
            assert "Gym" in {each.label for each in named.rooms}
        count += _check_other_words(level, before, most)
        for word, value in FAR.items():
            (far,) = [each for each in planned(level, Override(**{word: value})) if each.id == before.id]  # type: ignore[arg-type]
            assert [record["outcome"] for record in records(far)] == ["none"] or not records(far)
            assert not changed_shapes(before, far)
            assert far.quality == before.quality
    return count


FAR: dict[str, object] = {
    "door": [[9e3, 9e3], [9e3, 9e3 + 1]],
    "wall": [[9e3, 9e3], [9e3, 9e3 + 1]],
    "no_wall": [[9e3, 9e3], [9e3, 9e3 + 1]],
    "no_room": [9e3, 9e3],
    "outside": [9e3, 9e3],
    "window": [9e3, 9e3],
    "room_outline": [[9e3, 9e3], [9e3 + 3, 9e3], [9e3, 9e3 + 3]],
}
"""A word of each form, 9 km away."""


def _check_other_words(level: Level, before: FloorPlan, most: int) -> int:
    """Take walls out, make rooms one and windows of entrances, one at a time; return how many."""
    count = 0
    for line, one, other in list(walls_without_door(before))[: most - 1]:
        drawn = in_source(before, line)
        sides = [Polygon(in_source(before, room.ring)) for room in (one, other)]
        between = [
            Polygon(in_source(before, door.ring)) for door in before.doors if set(door.rooms) == {one.id, other.id}
        ]
        touched = shapely.union_all([*sides, *between, LineString(drawn).buffer(0.6)])
        after = check(level, before, Override(no_wall=drawn), touched)
        assert len(after.rooms) == len(before.rooms) - 1
        count += 1
    for door in [door for door in before.doors if None not in door.rooms][: most - 1]:
        pair = [before.rooms[side] for side in door.rooms if side is not None]
        places = in_source(before, [room.polygon.representative_point().coords[0] for room in pair])
        between = [each for each in before.doors if set(each.rooms) == set(door.rooms)]
        touched = shapely.union_all([Polygon(in_source(before, each.ring)) for each in (*pair, *between)])
        after = check(level, before, Override(one_room=places), touched.buffer(0.6))
        assert len(after.rooms) == len(before.rooms) - 1
        count += 1
    for door in [door for door in before.doors if door.kind == "entrance"][: most - 1]:
        place = in_source(before, [door.polygon.centroid.coords[0]])[0]
        after = check(level, before, Override(window=place), Polygon(in_source(before, door.ring)).buffer(0.05))
        assert len(after.doors) == len(before.doors) - 1
        count += 1
    return count


@pytest.mark.slow
def test_fifteen_doors_drawn_in_made_homes_open_fifteen_walls() -> None:
    drawn = 0
    for level in levels("procedural:16?style=published"):
        drawn += check_level(level, 2)
        if drawn >= 15:
            return
    raise AssertionError(f"the homes have only {drawn} walls without a door")


@pytest.mark.slow
def test_corrections_of_houses_with_hard_cases_stay_local(tmp_path: Path) -> None:
    write_houses(tmp_path, 20, 0)
    assert sum(_of_level(level) for level in levels(str(tmp_path))) > 10


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, *RAW])
def test_corrections_of_each_kind_stay_local(kind: str, tmp_path: Path) -> None:
    for level in levels(str(make_member(kind, 0, 3, tmp_path).path)):
        _of_level(level)


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("file", sorted(p.name for p in (DATA / "found").glob("*") if p.suffix != ".pgm"))
def test_corrections_of_found_files_stay_local(file: str) -> None:
    for level in _unless_rejected(lambda: list(levels(str(DATA / "found" / file)))):
        _of_level(level)


def _of_level(level: Level) -> int:
    """Check a level, unless it gives no plan without corrections."""
    try:
        planned(level)
    except Rejection:
        return 0
    return check_level(level, 2)


def _unless_rejected(read: Callable[[], list[Level]]) -> list[Level]:
    try:
        return read()
    except Rejection:
        return []
