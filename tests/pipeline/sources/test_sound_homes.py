"""Sound homes: the rules that they keep, over seeds, and that the pipeline reads them back."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely
from shapely.affinity import translate

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.furnish import furnish_plan
from pipeline.sources import find, reader
from pipeline.sources.sound_homes.home import LIMITS, LIT, SLEEPING, make_sound_home, sound_home_id
from pipeline.sources.sound_homes.level import level_from_sound_home, sound_home_digest
from pipeline.sources.sound_homes.values import HALL, SoundHome
from pipeline.values import Level

SEED, COUNT = 11, 24


@pytest.fixture(scope="module")
def homes() -> list[SoundHome]:
    return [make_sound_home(index, SEED) for index in range(COUNT)]


def graph_of(home: SoundHome) -> nx.Graph:
    graph = nx.Graph()
    graph.add_nodes_from(range(len(home.rooms)))
    graph.add_edges_from(door.rooms for door in home.doors)
    return graph


def test_the_same_seed_and_index_give_the_same_home_whatever_others_are_made(homes: list[SoundHome]) -> None:
    assert sound_home_digest(make_sound_home(7, SEED)) == sound_home_digest(homes[7])
    assert len({sound_home_digest(home) for home in homes}) == COUNT
    assert sound_home_digest(make_sound_home(7, SEED + 1)) != sound_home_digest(homes[7])


def test_rooms_are_plain_and_do_not_overlap(homes: list[SoundHome]) -> None:
    for home in homes:
        assert all(isinstance(room, shapely.Polygon) and not room.interiors for room in home.rooms), home.id
        one, other = shapely.STRtree(home.rooms).query(home.rooms, predicate="dwithin", distance=0.6 * home.inner_m)
        assert (one == other).all(), home.id


def test_bedrooms_and_a_toilet_are_reached_from_the_front_door_without_crossing_a_bedroom(
    homes: list[SoundHome],
) -> None:
    for home in homes:
        graph = graph_of(home)
        assert nx.is_connected(graph)
        assert home.fronts[0].rooms == (HALL, None)
        beds = {k for k, label in enumerate(home.labels) if label in SLEEPING}
        for bed in beds:
            assert nx.has_path(graph.subgraph(set(graph) - (beds - {bed})), HALL, bed), home.id
        assert any(home.labels[room] in {"Bathroom", "Toilet"} for room in graph[HALL]), home.id


def test_habitable_rooms_have_a_window_or_a_glazed_door(homes: list[SoundHome]) -> None:
    for home in homes:
        glazed = {window.room for window in home.windows}
        glazed |= {door.rooms[0] for door in home.doors if door.rooms[1] in home.balconies}
        glazed |= {door.rooms[0] for door in home.fronts[1:]}
        wide = [door.rooms for door in home.doors if max(np.subtract(door.rect[2:], door.rect[:2])) >= 1.5]
        open_to = [pair for one, other in wide if other is not None for pair in ((one, other), (other, one))]
        glazed |= {one for one, other in open_to if home.labels[one] == "Kitchen" and other in glazed}
        assert {k for k, label in enumerate(home.labels) if label in LIT} <= glazed, home.id


def test_each_home_has_a_kitchen_beside_a_day_room_or_the_hall(homes: list[SoundHome]) -> None:
    for home in homes:
        (kitchen,) = [room for room, label in enumerate(home.labels) if label == "Kitchen"]
        beside = {home.labels[room] for room in graph_of(home)[kitchen]}
        assert beside <= {"Living_Room", "Lobby", "Dining_Room", "Hallway"}, home.id


def test_rooms_keep_their_limits(homes: list[SoundHome]) -> None:
    for home in homes:
        for label, room in zip(home.labels, home.rooms, strict=True):
            if label in LIMITS:
                least, width, aspect = LIMITS[label]
                x1, y1, x2, y2 = room.bounds
                short, long = sorted((x2 - x1, y2 - y1))
                assert room.area >= least - 0.1, (home.id, label)
                assert short >= width - 0.02, (home.id, label)
                assert long <= aspect * short * 1.02, (home.id, label)


def test_doors_and_windows_lie_in_walls(homes: list[SoundHome]) -> None:
    for home in homes:
        rooms = shapely.union_all(home.rooms)
        taken = [shapely.box(*door.rect) for door in (*home.doors, *home.fronts)]
        panes = [shapely.box(*window.rect) for window in home.windows]
        assert max(shapely.area(shapely.intersection([*taken, *panes], rooms))) < 1e-3, home.id
        for door, gap in zip((*home.doors, *home.fronts), taken, strict=True):
            sides = [home.rooms[room] for room in door.rooms if room is not None]
            assert all(gap.distance(room) < 1e-3 for room in sides), home.id
            assert all(gap.distance(pane) > 0.1 for pane in panes), home.id


def test_a_balcony_has_parapets_that_one_sees_over(homes: list[SoundHome]) -> None:
    seen = 0
    for home in homes:
        heights = level_from_sound_home(home).walls.vertices[:, 2]
        assert np.isclose(heights, 1.0).any() == bool(home.balconies), home.id  # nothing else ends there
        seen += len(home.balconies)
    assert seen


@pytest.mark.slow
def test_the_pipeline_reads_back_what_was_made(homes: list[SoundHome]) -> None:
    same = 0
    for home in homes:
        (plan,) = plan_level(level_from_sound_home(home), PipelineConfig(), np.random.default_rng(0))
        assert isinstance(plan, FloorPlan)
        made = shapely.union_all([*home.rooms, *(shapely.box(*door.rect) for door in home.doors)], grid_size=1e-4)
        read = shapely.Polygon(plan.verts, plan.holes)
        read = translate(read, *(np.array(made.bounds[:2]) - read.bounds[:2]))
        doors = [door for door in plan.doors if door.kind in {"door", "opening"}]
        near = read.intersection(made).area > 0.99 * read.union(made).area
        same += near and len(plan.rooms) == len(home.rooms) and len(doors) == len(home.doors)
    assert same >= 0.95 * COUNT


@pytest.mark.slow
def test_a_home_can_be_furnished(homes: list[SoundHome]) -> None:
    for home in homes[:4]:
        (plan,) = plan_level(level_from_sound_home(home), PipelineConfig(), np.random.default_rng(0))
        assert isinstance(plan, FloorPlan)
        furnished = furnish_plan(plan, np.random.default_rng(0))
        assert {"bed", "sofa", "toilet"} & {thing.label for thing in furnished.objects}


def test_the_source_makes_them_one_by_one() -> None:
    items = list(find("procedural:3", seed="5"))
    assert list(find("procedural:3?style=sound", seed="5")) == items
    assert [item.id for item in items] == [sound_home_id(index, 5) for index in range(3)]
    (level,) = reader(items[1].reader).read(items[1])
    assert level.id == items[1].id
    assert isinstance(level, Level)
    assert level.provenance["sha256"] == sound_home_digest(make_sound_home(1, 5))
