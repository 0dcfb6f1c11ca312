"""Benchmarks measure; they run only where asked for (``make bench``), and print the rows of docs/benchmarks.md."""

from __future__ import annotations

import gzip

import pytest

from houseexpo import FloorPlan
from houseexpo.floorplan import decode
from tests.builders.shared import DATA

AREAS = (57.0, 117.0)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--benchmarks"):
        return
    skip = pytest.mark.skip(reason="a benchmark: make bench")
    for item in items:
        if "benchmarks" in item.path.parts:
            item.add_marker(skip)


@pytest.fixture(scope="module")
def houses() -> list[FloorPlan]:
    """Two published houses of 57 and 117 m2, or nearly."""
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line, _ in zip(stream, range(300), strict=False)]
    return [min(plans, key=lambda plan: abs(plan.area - area)) for area in AREAS]
