"""Sound homes: the rules that they keep, over seeds, and that the pipeline reads them back."""

from __future__ import annotations

from collections import Counter
from itertools import chain, count, islice, pairwise
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import shapely
from shapely.affinity import translate

from houseexpo.drawing.door_leaves import door_leaves
from houseexpo.drawing.stairs import stair_lines
from houseexpo.exports import export
from houseexpo.exports.storeys import storey_bodies
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.furnish import furnish_plan
from pipeline.sources import find, reader
from pipeline.sources.sound_homes.home import _OWN_STREAM, LIT, SLEEPING, make_sound_home, sound_home_id
from pipeline.sources.sound_homes.houses import WET
from pipeline.sources.sound_homes.level import levels_of_sound_home, sound_home_digest
from pipeline.sources.sound_homes.limits import LIMITS
from pipeline.sources.sound_homes.programme import STOREYS, draw_kind
from pipeline.sources.sound_homes.stairs import RISE_M, STOREY_M
from pipeline.sources.sound_homes.values import SoundHome, Storey
from research.home_oddities import oddities
from tests.builders.batch import likeness, plans_of

SEED, COUNT = 15, 24


@pytest.fixture(scope="module")
def homes() -> list[SoundHome]:
    return [make_sound_home(index, SEED) for index in range(COUNT)]


@pytest.fixture(scope="module")
def storeys(homes: list[SoundHome]) -> list[Storey]:
    return [storey for home in homes for storey in home.storeys]


def hall_of(storey: Storey) -> int:
    return storey.labels.index("Hallway")


def graph_of(storey: Storey) -> nx.Graph:
    graph = nx.Graph()
    graph.add_nodes_from(range(len(storey.rooms)))
    graph.add_edges_from(door.rooms for door in storey.doors)
    return graph


def test_the_same_seed_and_index_give_the_same_home_whatever_others_are_made(homes: list[SoundHome]) -> None:
    assert sound_home_digest(make_sound_home(7, SEED)) == sound_home_digest(homes[7])
    assert len({sound_home_digest(home) for home in homes}) == COUNT
    assert sound_home_digest(make_sound_home(7, SEED + 1)) != sound_home_digest(homes[7])


def test_rooms_are_plain_and_do_not_overlap(homes: list[SoundHome]) -> None:
    for home in homes:
        for storey in home.storeys:
            assert all(isinstance(room, shapely.Polygon) and not room.interiors for room in storey.rooms), home.id
            tree = shapely.STRtree(storey.rooms)
            one, other = tree.query(storey.rooms, predicate="dwithin", distance=0.6 * home.inner_m)
            assert (one == other).all(), home.id


def test_bedrooms_and_a_toilet_are_reached_from_the_front_door_without_crossing_a_bedroom(
    homes: list[SoundHome],
) -> None:
    for home in homes:
        for level, storey in enumerate(home.storeys):
            graph, hall = graph_of(storey), hall_of(storey)
            assert nx.is_connected(graph)
            fronts = [(storey.labels[door.rooms[0]], door.rooms[1]) for door in storey.fronts[:1]]
            assert fronts in ([[]] if level else [[("Hallway", None)], [("Entryway", None)]])
            near = [room for k in graph[hall] if storey.labels[k] == "Entryway" for room in graph[k]]
            beds = {k for k, label in enumerate(storey.labels) if label in SLEEPING}
            for bed in beds:
                assert nx.has_path(graph.subgraph(set(graph) - (beds - {bed})), hall, bed), home.id
            assert any(storey.labels[room] in {"Bathroom", "Toilet"} for room in {*graph[hall], *near}), home.id


def test_habitable_rooms_have_a_window_or_a_glazed_door(storeys: list[Storey]) -> None:
    for storey in storeys:
        glazed = {window.room for window in storey.windows}
        glazed |= {door.rooms[0] for door in storey.doors if door.rooms[1] in storey.balconies}
        glazed |= {door.rooms[0] for door in storey.fronts[1:]}
        wide = [door.rooms for door in storey.doors if max(np.subtract(door.rect[2:], door.rect[:2])) >= 1.5]
        open_to = [pair for one, other in wide if other is not None for pair in ((one, other), (other, one))]
        glazed |= {one for one, other in open_to if storey.labels[one] == "Kitchen" and other in glazed}
        assert {k for k, label in enumerate(storey.labels) if label in LIT} <= glazed


@pytest.mark.slow
def test_an_architect_finds_nothing_odd(homes: list[SoundHome]) -> None:
    levels = [level for home in homes for level in levels_of_sound_home(home)]
    plans = [plan_level(level, PipelineConfig(), np.random.default_rng(0))[0] for level in levels]
    found = Counter(oddity for plan in plans for oddity, has in oddities(plan) if has)
    assert found.total() <= 1, found  # a wall may be too short for its window


def test_each_home_has_a_kitchen_beside_a_day_room_or_the_hall(homes: list[SoundHome]) -> None:
    for home in homes:
        assert not any("Kitchen" in storey.labels for storey in home.storeys[1:])
        ground = home.storeys[0]
        (kitchen,) = [room for room, label in enumerate(ground.labels) if label == "Kitchen"]
        beside = {ground.labels[room] for room in graph_of(ground)[kitchen]}
        assert beside <= {"Living_Room", "Lobby", "Dining_Room", "Hallway"}, home.id


def test_rooms_keep_their_limits(storeys: list[Storey]) -> None:
    for storey in storeys:
        for label, room in zip(storey.labels, storey.rooms, strict=True):
            if label in LIMITS:
                least, width, aspect = LIMITS[label]
                x1, y1, x2, y2 = room.bounds
                short, long = sorted((x2 - x1, y2 - y1))
                assert room.area >= least - 0.1, label
                assert short >= width - 0.02, label
                assert long <= aspect * short * 1.02, label


def test_doors_and_windows_lie_in_walls(storeys: list[Storey]) -> None:
    for storey in storeys:
        rooms = shapely.union_all(storey.rooms)
        taken = [shapely.box(*door.rect) for door in (*storey.doors, *storey.fronts)]
        panes = [shapely.box(*window.rect) for window in storey.windows]
        assert max(shapely.area(shapely.intersection([*taken, *panes], rooms))) < 1e-3
        for door, gap in zip((*storey.doors, *storey.fronts), taken, strict=True):
            sides = [storey.rooms[room] for room in door.rooms if room is not None]
            assert all(gap.distance(room) < 1e-3 for room in sides)
            assert all(gap.distance(pane) > 0.1 for pane in panes)


def test_a_balcony_and_the_edge_of_a_floor_have_parapets_that_one_sees_over(homes: list[SoundHome]) -> None:
    seen = 0
    for home in homes:
        for storey, level in zip(home.storeys, levels_of_sound_home(home), strict=True):
            has_edge = storey.void is not None and not storey.void.railing.is_empty
            heights = level.walls.vertices[:, 2]
            free = [k for k in storey.balconies if not courtyard_of(storey)]
            assert np.isclose(heights, 1.0).any() == bool(free or has_edge), home.id  # nothing else ends there
            seen += len(free)
    assert seen


def courtyard_of(storey: Storey) -> list[int]:
    """The rooms outside that the rooms inside surround."""
    inside = [room for k, room in enumerate(storey.rooms) if k not in storey.balconies]
    rings = shapely.union_all(shapely.buffer(inside, 0.2, join_style="mitre"))
    holes = [shapely.Polygon(ring) for part in shapely.get_parts(rings).tolist() for ring in part.interiors]
    return [k for k in storey.balconies if any(hole.covers(storey.rooms[k]) for hole in holes)]


@pytest.fixture(scope="module")
def atriums() -> list[Storey]:
    """The first three homes with a courtyard."""
    of_kind = (k for k in count() if draw_kind(np.random.default_rng([SEED, k, _OWN_STREAM])) == "bungalow")
    made = (make_sound_home(index, SEED).storeys[0] for index in of_kind)
    return list(islice((storey for storey in made if courtyard_of(storey)), 3))


def test_rooms_lie_on_four_sides_of_a_courtyard_and_lead_into_it(atriums: list[Storey]) -> None:
    for storey in atriums:
        (court,) = courtyard_of(storey)
        x1, y1, x2, y2 = storey.rooms[court].bounds
        assert min(x2 - x1, y2 - y1) >= 3.25
        assert storey.labels[court] == "Terrace"
        ways = {storey.labels[room] for door in storey.doors if court in door.rooms for room in door.rooms}
        assert ways >= {"Terrace", "Living_Room", "Hallway"}
        beside = {
            int(np.argmax(np.abs(np.subtract(window.rect[:2], storey.rooms[court].centroid.coords[0]))))
            for window in storey.windows
            if shapely.box(*window.rect).distance(storey.rooms[court]) < 1e-3
        }
        assert beside, "no window looks into it"


def test_a_bedroom_at_the_hall_has_its_door_there(homes: list[SoundHome]) -> None:
    """But for what a bedroom or an entry alone leads to; the living room leads to those that no hall touches."""
    for home in homes:
        storey = home.storeys[0]
        living = [room for room, label in enumerate(storey.labels) if label == "Living_Room"]
        graph, hall = graph_of(storey), storey.rooms[hall_of(storey)]
        for room, label in enumerate(storey.labels):
            if label in SLEEPING and set(graph[room]) & set(living):
                near = hall.buffer(home.inner_m + 0.01, join_style="mitre").intersection(storey.rooms[room])
                assert near.area < 1.1 * 0.02, home.id


def test_ways_between_day_rooms_without_a_leaf_are_openings(homes: list[SoundHome]) -> None:
    days = {"Living_Room", "Dining_Room", "Kitchen"}
    found = 0
    for home in homes:
        for storey, level in zip(home.storeys, levels_of_sound_home(home), strict=True):
            for door, opening in zip((*storey.doors, *storey.fronts), level.openings, strict=True):
                assert opening.has_door != door.is_open
                labels = {storey.labels[room] for room in door.rooms if room is not None}
                wide = max(np.subtract(door.rect[2:], door.rect[:2])) > 1.25
                assert door.is_open or not wide or not labels <= days, home.id
                found += door.is_open and labels <= days
    assert found > COUNT / 2


@pytest.fixture(scope="module")
def houses() -> list[SoundHome]:
    """The first eight houses of several storeys, and the first of three."""
    of_kind = (k for k in count() if draw_kind(np.random.default_rng([SEED, k, _OWN_STREAM])) in STOREYS)
    made = (make_sound_home(index, SEED) for index in of_kind)
    found = list(islice(made, 8))
    return [*found, next(home for home in chain(found, made) if len(home.storeys) > 2)]


def test_stairs_stand_above_stairs_and_the_floor_is_open_over_them(houses: list[SoundHome]) -> None:
    for home in houses:
        for below, above in pairwise(home.storeys):
            assert above.void is not None
            stair = shapely.union_all([step.area for step in below.steps])
            assert above.void.area.buffer(0.001).covers(stair), home.id
            assert max(shapely.area(shapely.intersection(above.rooms, above.void.area))) < 1e-6, home.id
            assert above.rooms[hall_of(above)].distance(above.void.landing) < 1e-3, home.id
            if above.steps:
                again = shapely.union_all([step.area for step in above.steps])
                assert again.symmetric_difference(stair).area < 1e-3, home.id
        assert not home.storeys[-1].steps
        assert home.storeys[0].void is None


def test_steps_rise_alike_from_the_hall_to_the_landing(houses: list[SoundHome]) -> None:
    for home in houses:
        for below, above in pairwise(home.storeys):
            tops = [0.0, *(step.top_m for step in below.steps), STOREY_M]
            assert np.diff(tops) == pytest.approx(RISE_M)
            assert RISE_M <= 0.2
            assert all(one.area.distance(two.area) < 0.15 for one, two in pairwise(below.steps)), home.id
            assert above.void is not None
            assert below.steps[-1].area.distance(above.void.landing) < 1e-3, home.id
            if below is home.storeys[0]:
                (foot,) = [door for door in below.doors if door.rooms == (hall_of(below), below.labels.index("Stairs"))]
                assert shapely.box(*foot.rect).distance(below.steps[0].area) < 1.0, home.id


def test_people_have_headroom_on_all_steps(houses: list[SoundHome]) -> None:
    """2 m from each step to the stair above it, the only thing above it."""
    for home in houses:
        for below, above in pairwise(home.storeys):
            for step in below.steps:
                for over in above.steps:
                    if step.area.intersection(over.area).area > 1e-6:
                        assert STOREY_M + over.prism[1] - step.top_m >= 2.0, home.id


def test_outer_walls_and_those_of_the_stair_stand_above_each_other(houses: list[SoundHome]) -> None:
    for home in houses:
        beside = {"Garage", "Terrace"}
        ground = [
            r for r, label in zip(home.storeys[0].rooms, home.storeys[0].labels, strict=True) if label not in beside
        ]
        for below, above in pairwise(home.storeys):
            assert above.void is not None
            rooms = [room for k, room in enumerate(above.rooms) if k not in above.balconies]
            upper = shapely.union_all([*rooms, above.void.area]).bounds
            lower = shapely.union_all(ground).bounds
            apart = np.abs(np.subtract(upper, lower))
            assert shapely.box(*lower).buffer(1e-3).covers(shapely.box(*upper)), home.id
            assert (apart > 1e-3).sum() <= 2, home.id  # where the living room comes forward, and where it has a bay
            assert apart.max() <= 2.0 + 0.95, home.id
            if below.void is not None:
                assert below.void.area.equals(above.void.area), home.id
            else:
                stair = below.rooms[below.labels.index("Stairs")]
                assert above.void.area.buffer(0.001).covers(stair), home.id


def test_an_upper_storey_shows_its_stair_where_no_robot_gets(houses: list[SoundHome]) -> None:
    for home in houses[-3:]:
        for storey, level in zip(home.storeys, levels_of_sound_home(home), strict=True):
            (plan,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            assert isinstance(plan, FloorPlan)
            assert len(list(stair_lines(plan))) >= 10, home.id
            furnished = furnish_plan(plan, np.random.default_rng(0))
            for each in (plan, furnished):
                wells = [thing.polygon for thing in each.objects if thing.is_stairwell]
                assert len(wells) == (storey.void is not None), home.id
                for well in wells:
                    assert well.area == pytest.approx(storey.void.area.area, abs=0.1)
                    assert well.intersection(each.free_space).area < 1e-3, home.id
                    assert each.floor.covers(well), home.id
            assert plan.free_space.covers(furnished.free_space), home.id
            assert len(furnished.objects) > len(plan.objects), home.id


def test_baths_lie_over_pipes(houses: list[SoundHome]) -> None:
    for home in houses:
        for below, above in pairwise(home.storeys):
            wet = shapely.union_all([r for r, label in zip(below.rooms, below.labels, strict=True) if label in WET])
            for room, label in zip(above.rooms, above.labels, strict=True):
                assert label != "Bathroom" or room.buffer(0.2).intersection(wet).area > 0.2, home.id


def test_a_house_has_its_levels_at_their_heights(houses: list[SoundHome]) -> None:
    for home in houses:
        levels = list(levels_of_sound_home(home))
        assert [level.id for level in levels] == [f"{home.id}_L{k}" for k in range(len(home.storeys))]
        assert [level.frame.level for level in levels] == list(range(len(levels)))
        assert [level.frame.floor for level in levels] == pytest.approx([STOREY_M * k for k in range(len(levels))])
        assert {level.provenance["sha256"] for level in levels} == {sound_home_digest(home)}


@pytest.mark.slow
def test_the_pipeline_reads_back_what_was_made(homes: list[SoundHome]) -> None:
    same = number = 0
    for home in homes:
        for storey, level in zip(home.storeys, levels_of_sound_home(home), strict=True):
            (plan,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            assert isinstance(plan, FloorPlan)
            made = shapely.union_all(
                [*storey.rooms, *(shapely.box(*door.rect) for door in storey.doors)], grid_size=1e-4
            )
            read = shapely.Polygon(plan.verts, plan.holes)
            shift = np.array(made.bounds[:2]) - read.bounds[:2]
            read = translate(read, *shift)
            doors = [door for door in plan.doors if door.kind in {"door", "opening"}]
            middles = shapely.multipoints([np.mean(door.segment, axis=0) + shift for door in doors])
            near = read.intersection(made).area > 0.99 * read.union(made).area
            in_wall = all(middles.distance(shapely.box(*door.rect).centroid) < 0.025 for door in storey.doors)
            windows = [window.polygon.bounds + np.tile(shift, 2) for window in plan.windows]
            assert np.reshape(windows, (-1, 4)) == pytest.approx(
                np.reshape([w.rect for w in storey.windows], (-1, 4)), abs=0.011
            )
            assert [(each.sill, each.head) for each in plan.windows] == [(w.sill_m, w.head_m) for w in storey.windows]
            for window, found in zip(storey.windows, plan.windows, strict=True):
                beside = {plan.room(room).label for room in found.rooms if room is not None}
                assert {storey.labels[window.room].replace("Stairs", "Unlabelled")} <= beside
            same += near and in_wall and len(plan.rooms) == len(storey.rooms) and len(doors) == len(storey.doors)
            number += 1
    assert same >= 0.95 * number


@pytest.mark.slow
@pytest.mark.parametrize("name", ["glb", "ifc"])
def test_the_storeys_of_an_exported_house_come_back(houses: list[SoundHome], tmp_path: Path, name: str) -> None:
    plans = []
    for level in levels_of_sound_home(houses[0]):
        (plan,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        assert isinstance(plan, FloorPlan)
        plans.append(plan)
    export(plans, name, tmp_path, building="house")
    (file,) = tmp_path.rglob(f"*.{name}")
    back = plans_of(file)
    assert [len(plan.rooms) for plan in back] == [len(plan.rooms) for plan in plans]
    assert all(likeness(one, other) > 0.99 for one, other in zip(plans, back, strict=True))
    stack = storey_bodies(plans, "house", {})
    assert all(each.slab.intersection(t.polygon).area < 1e-3 for each in stack for t in each.built.plan.objects)


@pytest.mark.slow
def test_doors_swing_free_of_each_other_and_of_furniture() -> None:
    """In nearly all of 40 more homes, empty and furnished."""
    free = []
    for home in (make_sound_home(index, SEED + 1) for index in range(40)):
        for level in levels_of_sound_home(home):
            (empty,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            assert isinstance(empty, FloorPlan)
            for plan in (empty, furnish_plan(empty, np.random.default_rng(0))):
                swings = [leaf.swing for leaves in door_leaves(plan).values() for leaf in leaves]
                things = [*swings, *(thing.polygon for thing in plan.objects)]
                one, other = shapely.STRtree(things).query(swings, predicate="intersects")
                pairs = [(swings[i], things[k]) for i, k in zip(one, other, strict=True) if i != k]
                free.append(all(first.intersection(second).area < 0.02 for first, second in pairs))
    assert np.mean(free) > 0.95


@pytest.mark.slow
def test_a_home_is_furnished_so_that_one_can_live_in_it(homes: list[SoundHome]) -> None:
    """Nearly all rooms for sleeping have a bed, studios too, most with 0.55 m free along it; nothing is on stairs."""
    places = beds = reached = 0
    for home in homes:
        for level in levels_of_sound_home(home):
            (plan,) = plan_level(level, PipelineConfig(), np.random.default_rng(0))
            assert isinstance(plan, FloorPlan)
            things = furnish_plan(plan, np.random.default_rng(0)).objects
            rooms = {room.id: room for room in plan.rooms}
            sleeping = SLEEPING | ({"Living_Room"} if home.kind == "studio" else set())
            places += sum(room.label in sleeping for room in plan.rooms)
            assert not any("stairs" in rooms[thing.room].source_labels for thing in things if thing.room is not None)
            for bed in things:
                if bed.label in {"bed", "single bed"} and bed.room is not None:
                    beds += 1
                    others = [o.polygon for o in things if o is not bed and o.label != "nightstand"]
                    free = rooms[bed.room].polygon.difference(shapely.union_all(others)).buffer(0.01)
                    reached += any(free.covers(side) for side in long_sides(bed.polygon.bounds))
    assert beds >= 0.95 * places
    assert reached >= 0.9 * beds


def long_sides(box: tuple[float, float, float, float]) -> list[shapely.Polygon]:
    """0.55 m along each long side of a bed, but for half a metre at its ends, where nightstands are."""
    x1, y1, x2, y2 = box
    if x2 - x1 > y2 - y1:
        return [shapely.box(x1 + 0.5, y, x2 - 0.5, y + 0.55) for y in (y2, y1 - 0.55)]
    return [shapely.box(x, y1 + 0.5, x + 0.55, y2 - 0.5) for x in (x2, x1 - 0.55)]


def test_the_source_makes_them_one_by_one(homes: list[SoundHome]) -> None:
    items = list(find(f"procedural:{COUNT}", seed=str(SEED)))
    assert list(find(f"procedural:{COUNT}?style=sound", seed=str(SEED))) == items
    assert [item.id for item in items] == [sound_home_id(index, SEED) for index in range(COUNT)]
    for item, home in zip(items, homes, strict=True):
        if len(home.storeys) == 2:
            levels = list(reader(item.reader).read(item))
            assert [level.id for level in levels] == [f"{item.id}_L0", f"{item.id}_L1"]
            return
    pytest.fail("no house of two storeys")
