from __future__ import annotations

import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Navigability, Room
from houseexpo.summary_plugins import new_summaries
from stats.summary import PlanSummary
from tests.stats.conftest import box


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


def test_the_build_finds_it_by_its_entry_point() -> None:
    assert isinstance(new_summaries()["plans"], PlanSummary)
