from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from houseexpo.analysis.similarity import SYMMETRIES
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Navigability, PlanObject, Quality, Room
from stats.record import measure_plan, ring_digest, ring_fault, shape_digest
from stats.summary import PlanSummary
from stats.tally import Tally
from tests.stats.conftest import box, outline


def flat(name: str, components: int = 1) -> FloorPlan:
    """Return two rooms that share a whole side, one labelled, with a cut between them."""
    rooms = (Room(0, "Kitchen", box(0.1, 0.1, 3.1, 3.1)), Room(1, "Unlabelled", box(3.1, 0.1, 5.1, 3.1)))
    door = Door(0, "cut", ((3.1, 1.0), (3.1, 1.8)), 0.8, box(3.05, 1.0, 3.15, 1.8), (0, 1))
    reach = {"0.20": Navigability(components, 1.0 if components == 1 else 0.6, 0.8)}
    return FloorPlan(
        name, box(0.1, 0.1, 5.1, 3.1), 2, {"Kitchen": ((0.1, 0.1, 3.1, 3.1),)}, (), rooms, (door,), None, reach
    )


def published() -> FloorPlan:
    boxes = {"Bedroom": ((0.1, 0.1, 2.1, 2.1), (2.1, 0.1, 4.1, 2.1))}
    return FloorPlan("published", box(0.1, 0.1, 4.1, 2.1), 3, boxes)


def test_measures_are_added_up() -> None:
    summary = PlanSummary()
    for plan in (flat("a"), flat("b", components=2), published()):
        summary.add(plan)
    report = summary.report()
    assert (report["source_rooms"]["count"], report["source_rooms"]["median"]) == (3, 2.0)
    assert report["rooms"]["count"] == 2
    assert report["area_m2"]["max"] == 15.0
    assert report["labels"] == {"Bedroom": 2, "Kitchen": 2, "Unlabelled": 2}
    assert report["door_kinds"] == {"cut": 2}
    assert report["plans_with_cuts"] == 2
    assert report["count"] == 3
    assert report["rings"]["repeats"] == 1
    reach = report["navigability"]["0.20"]
    assert (reach["plans"], reach["connected"]) == (3, 2), "one plan states that it falls into two pieces"
    assert reach["largest_share"]["mean"] == pytest.approx((1.0 + 0.6 + 1.0) / 3, abs=1e-4)
    assert report["navigability"]["0.35"]["plans"] == 1, (
        "what a plan does not state is measured only where it states nothing"
    )


def test_two_summaries_add_up() -> None:
    whole, one, other = PlanSummary(), PlanSummary(), PlanSummary()
    for part, plan in ((one, flat("a")), (other, published()), (other, flat("b", 2))):
        whole.add(plan)
        part.add(plan)
    other.merge(one)
    assert other.report() == whole.report()


# Tallies.


def filled(values: list[float], **how: float) -> Tally:
    tally = Tally(**how)
    for value in values:
        tally.add(value)
    return tally


def test_report_of_whole_numbers() -> None:
    assert filled([3, 1, 1, 7]).report() == {
        "count": 4,
        "sum": 12.0,
        "mean": 3.0,
        "std": 2.4495,
        "p05": 1.0,
        "median": 2.0,
        "p95": 6.4,
        "min": 1.0,
        "max": 7.0,
        "histogram": {"1": 2, "3": 1, "7": 1},
    }


def test_moments_and_quantiles_are_those_of_numpy() -> None:
    values = np.random.default_rng(1).normal(50.0, 7.0, 400).round(2)
    shares = [0.0, 0.05, 0.5, 0.951, 1.0]
    found = [filled(values.tolist(), step=0.01).quantile(share) for share in shares]
    assert found == pytest.approx(np.quantile(values, shares), abs=1e-4)
    assert filled(values.tolist(), step=0.01).moments() == pytest.approx((values.mean(), values.std()), abs=1e-9)


# Measures of one plan.


def test_a_house_with_rooms(ring_of_rooms: FloorPlan) -> None:
    found = measure_plan(ring_of_rooms)
    numbers = found.numbers
    assert (numbers["rooms"], numbers["doors"]) == ([4], [5])
    assert numbers["doors_per_room"] == [3, 3, 1, 2]
    assert numbers["degree"] == [2, 2, 1, 1]
    assert numbers["loops"] == [1], "two doors between the same rooms are a way round"
    assert numbers["depth"] == [3], "entrance into 3, then 0, 1, 2"
    assert numbers["room_area_m2"] == pytest.approx([4.0, 4.0, 4.0, 2.0])
    assert found.door_kinds == {"door": 2, "opening": 1, "cut": 1, "entrance": 1}


def test_quality_and_furniture_are_of_plans_that_have_them(ring_of_rooms: FloorPlan) -> None:
    assert not {"quality", "furniture"} & set(measure_plan(ring_of_rooms).numbers)
    stool = PlanObject(0, "stool", None, [(0.5, 0.5), (0.5, 0.8), (0.8, 0.8)], 0.45)
    told = replace(ring_of_rooms, quality=Quality(0.75), objects=(stool,))
    assert (measure_plan(told).numbers["quality"], measure_plan(told).numbers["furniture"]) == ([0.75], [1])


def test_an_outline_has_no_doors_to_count() -> None:
    numbers = measure_plan(outline("a", 4.0, 3.0)).numbers
    assert not {"doors", "loops", "depth", "rooms", "doors_per_room"} & set(numbers)
    assert numbers["label_boxes"] == [2]
    assert numbers["area_m2"] == pytest.approx([12.0])
    assert numbers["long_side_m"] + numbers["short_side_m"] == pytest.approx([4.0, 3.0])


def test_rings_that_are_not_simple() -> None:
    crossing = FloorPlan("x", [(0, 0), (2, 2), (2, 0), (0, 2.5)], 1, {})
    touching = FloorPlan("t", [(0, 0), (0, 4), (2, 2), (4, 4), (4, 0), (2, 2)], 1, {})
    assert ring_fault(crossing) == "crosses"
    assert ring_fault(touching) == "touches"
    assert ring_fault(outline("a")) is None


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_turned_or_mirrored_plan_has_the_same_shape(symmetry: str, ring_of_rooms: FloorPlan) -> None:
    swap, flip_y, flip_x = SYMMETRIES[symmetry]
    verts = ring_of_rooms.verts[:, ::-1] if swap else ring_of_rooms.verts
    verts = verts * np.array([-1 if flip_x else 1, -1 if flip_y else 1]) + 7.3
    moved = FloorPlan("moved", np.roll(verts, 2, axis=0)[::-1], 4, {})
    bare = FloorPlan("bare", ring_of_rooms.verts, 4, {})
    assert shape_digest(moved) == shape_digest(bare)
    assert ring_digest(moved) != ring_digest(bare)
