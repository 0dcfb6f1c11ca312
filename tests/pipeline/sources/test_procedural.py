"""What the generator makes, over 300 houses: how many of each kind, how large, how labelled, what is wrong."""

from __future__ import annotations

from collections import Counter
from statistics import median

import pytest
import shapely
from shapely.affinity import scale, translate

from houseexpo.plan.categories import LABELS
from pipeline.sources.procedural.house import (
    DUPLICATES,
    PER_HUNDRED,
    level_id,
    make_house,
    original_of,
    role_of,
    scene_id,
)
from pipeline.sources.procedural.truth import Area, TrueRoom, Truth, storey_truth

SEED, COUNT = 11, 300


def _truths(index: int, seed: int) -> list[Truth]:
    house = make_house(index, seed)
    return [storey_truth(storey, level_id(house.id, k), k, 0.0) for k, storey in enumerate(house.storeys)]


@pytest.fixture(scope="module")
def houses() -> list[list[Truth]]:
    return [_truths(index, SEED) for index in range(COUNT)]


@pytest.fixture(scope="module")
def plans(houses: list[list[Truth]]) -> list[Truth]:
    return [truth for levels in houses for truth in levels if truth.expected == "plan"]


def _polygon(area: Area | TrueRoom) -> shapely.Polygon:
    return shapely.Polygon(area.polygon, area.holes)


def _free(truth: Truth) -> shapely.Geometry:
    """Return the free space with its lower left corner at the origin."""
    free = shapely.union_all([_polygon(area) for area in truth.outline])
    return translate(free, -free.bounds[0], -free.bounds[1])


def _share(houses: list[list[Truth]], feature: str) -> float:
    return sum(any(feature in name for name in levels[0].features) for levels in houses) / len(houses)


@pytest.mark.slow
def test_number_of_rooms_is_that_of_published_plans(plans: list[Truth]) -> None:
    numbers = [truth.room_num for truth in plans]
    assert 6 <= median(numbers) <= 8
    assert min(numbers) == 1
    assert max(numbers) >= 20


@pytest.mark.slow
def test_labels_are_drawn_from_published_counts(plans: list[Truth]) -> None:
    published = {"Bedroom": 0.180, "Room": 0.159, "Bathroom": 0.134, "Toilet": 0.116, "Kitchen": 0.096, "Office": 0.050}
    found = Counter(label for truth in plans for room in truth.rooms for label in room.labels)
    assert set(found) <= set(LABELS)
    assert len(found) >= 18
    for label, share in published.items():
        assert found[label] / found.total() == pytest.approx(share, abs=0.05)
    assert any(not room.labels for truth in plans for room in truth.rooms)
    assert any(len(room.labels) == 2 for truth in plans for room in truth.rooms)


def test_rooms_are_as_large_as_their_use_asks(plans: list[Truth]) -> None:
    def typical(label: str) -> float:
        return median(_polygon(r).area for truth in plans for r in truth.rooms if r.labels == [label])

    assert 2 < typical("Toilet") < typical("Bathroom") < typical("Bedroom") < typical("Living_Room") < 35


def test_shapes_that_the_data_set_has(houses: list[list[Truth]], plans: list[Truth]) -> None:
    assert _share(houses, "loop") >= 0.25
    assert _share(houses, "ring") >= 0.15
    assert _share(houses, "oblique") >= 0.10
    assert _share(houses, "wing") >= 0.2
    assert sum(len(levels) > 1 for levels in houses) >= 0.05 * COUNT
    looped = [any(area.holes for area in truth.outline) for truth in plans]
    assert looped == ["loop" in truth.features for truth in plans]


def test_each_difficulty_has_its_share_and_half_the_houses_are_sound(houses: list[list[Truth]]) -> None:
    planted = Counter(name for levels in houses for name in levels[0].difficulties)
    assert sum(not levels[0].difficulties for levels in houses) >= 0.5 * COUNT
    for name in PER_HUNDRED:
        if name not in DUPLICATES:
            assert planted[name] >= 0.03 * COUNT, name
    assert planted["exact_duplicate"] >= 0.03 * COUNT
    assert sum(planted[name] for name in DUPLICATES if name != "exact_duplicate") >= 0.03 * COUNT


def test_every_room_can_be_reached_unless_its_door_was_left_out(plans: list[Truth]) -> None:
    for truth in plans:
        cuts = int("no_door" in truth.difficulties)
        assert (truth.cuts, len(truth.outline)) == (cuts, cuts + 1)
        standing = shapely.get_parts(_free(truth).buffer(-0.2))
        assert sum(part.area > 0.5 for part in standing) == cuts + 1


def test_closed_cells_are_small_and_said_to_be_filled(plans: list[Truth]) -> None:
    for truth in plans:
        cells = [_polygon(area) for area in truth.filled]
        assert bool(cells) == ("closed_cell" in truth.difficulties)
        assert all(0.05 < cell.area < 2.0 and cell.intersection(_free(truth)).area < 1e-6 for cell in cells)


def test_a_garage_apart_is_far_and_small(plans: list[Truth]) -> None:
    for truth in plans:
        assert bool(truth.erased) == ("garage_apart" in truth.difficulties)
        for area in truth.erased:
            main = shapely.union_all([_polygon(part) for part in truth.outline])
            assert _polygon(area).distance(main) - 0.2 > 2.0  # less a wall on either side
            assert _polygon(area).area < 0.25 * main.area


def test_scenes_without_a_layout_expect_rejection(houses: list[list[Truth]]) -> None:
    expected = {name: truth.expected for levels in houses for truth in levels for name in truth.difficulties}
    assert expected["objects_only"] == "rejected:no_layout"
    assert expected["characters"] == "rejected:characters"


@pytest.mark.parametrize("kind", DUPLICATES)
def test_duplicates_repeat_an_earlier_sound_house(kind: str) -> None:
    index = next(k for k in range(COUNT) if role_of(k, SEED) == kind)
    source = original_of(index, SEED)
    assert source < index
    assert role_of(source, SEED) == "sound"
    for copy, original in zip(_truths(index, SEED), _truths(source, SEED), strict=True):
        assert copy.expected == f"duplicate_of:{original.id}"
        a, b = _free(copy), _free(original)
        if kind == "mirrored_duplicate":
            a = scale(a, -1, 1, origin=a.centroid)
            a = translate(a, -a.bounds[0], -a.bounds[1])
        difference = a.symmetric_difference(b).area / max(a.area, b.area)
        assert difference < 0.01
        assert (difference > 1e-4) == (kind == "jittered_duplicate")


def test_a_house_depends_on_its_number_and_the_seed_alone() -> None:
    assert scene_id(3, 1) != scene_id(3, 2) != scene_id(4, 2)
    assert _truths(40, 1)[0].to_json() == _truths(40, 1)[0].to_json()
    assert _truths(40, 1)[0].to_json() != _truths(40, 2)[0].to_json()
