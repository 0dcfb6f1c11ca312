"""The report of the whole is the sum of its parts, however plans are dealt out to shards."""

from __future__ import annotations

from functools import cache

from hypothesis import given
from hypothesis import strategies as st

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Navigability
from stats.record import Record, measure_plan
from stats.summary import PlanSummary
from stats.tally import Tally
from tests.builders.tries import tries

LABELS = ("Kitchen", "Bedroom", "Hall")


@cache
def measured(number: int) -> Record:
    """Return the record of one of many small houses; some repeat others."""
    width, height = 3 + number % 7, 2 + number % 5
    verts = [(0.1, 0.1), (0.1, 0.1 + height), (0.1 + width, 0.1 + height), (0.1 + width, 0.1)]
    boxes = {LABELS[number % 3]: ((0.1, 0.1, 1.0, 1.0),) * (number % 4)}
    reach = {"0.20": Navigability(1 + number % 2, 1.0 - 0.1 * (number % 2), 0.7 + 0.01 * (number % 9))}
    return measure_plan(FloorPlan(f"h{number}", verts, number % 11, boxes, navigability=reach))


@tries(60)
@given(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 3)), max_size=40), st.permutations(range(4)))
def test_shards_add_up(dealt: list[tuple[int, int]], order: list[int]) -> None:
    whole, shards = PlanSummary(), [PlanSummary() for _ in range(4)]
    for number, shard in dealt:
        whole.take(measured(number))
        shards[shard].take(measured(number))
    total = PlanSummary()
    for shard in order:
        total.merge(shards[shard])
    assert total.report() == whole.report()


@tries(100)
@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=60), st.floats(0.0, 1.0))
def test_quantiles_lie_among_the_numbers(values: list[float], share: float) -> None:
    tally = Tally(step=0.01, bin_width=1.0)
    for value in values:
        tally.add(value)
    found = tally.report()
    assert found["min"] <= tally.quantile(share) <= found["max"]
    assert sum(found["histogram"].values()) == found["count"] == len(values)
    assert min(values) - 0.006 <= found["mean"] <= max(values) + 0.006
