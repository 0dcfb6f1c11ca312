"""How long the benchmark takes: decisions of the policies that plan, and steps a second of all of them.

Twenty plans of the benchmark's list, track ``exploration-quality-v1``, one process. A decision is what a policy does
where it decides anew, its search for frontiers and ways included.
"""

from __future__ import annotations

import os
import time

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo import Dataset, open_dataset
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.benchmark.cases import cases_of, written_ids
from houseexpo.pseudoslam.benchmark.episodes import Runner
from houseexpo.pseudoslam.benchmark.tracks import track_of
from tests.builders.shared import DATA, needs_shared

PLANS = 20
POLICIES = ("frontier", "information", "tour", "oracle", "wall", "forward")
ASKED_MS = {"frontier": "1"}
QUALITY = track_of("quality")

pytestmark = needs_shared


@pytest.fixture(scope="module")
def plans() -> Dataset:
    return open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz").only(written_ids()[:PLANS])


def test_decisions_and_steps(plans: Dataset) -> None:
    table = Table(title=f"{PLANS} plans, {QUALITY.id}, one process; load {os.getloadavg()[0]:.1f}")
    for heading in ("policy", "ms a decision, median", "mean", "asked", "steps a second", "s a plan"):
        table.add_column(heading, justify="right" if heading != "policy" else "left")
    first, *cases = cases_of(QUALITY.id, plans.ids)
    for name in POLICIES:
        runner = Runner(QUALITY, load_policy(name), plans)
        runner.run(first)  # what has to be compiled is compiled
        start = time.perf_counter()
        found = [runner.run(case) for case in cases]
        took = time.perf_counter() - start
        decisions = np.concatenate([each.decisions_ms for each in found])
        steps = sum(each.values["steps"] or 0 for each in found)
        table.add_row(
            name, f"{np.median(decisions):.3f}", f"{decisions.mean():.3f}", ASKED_MS.get(name, ""),
            f"{steps / took:,.0f}", f"{took / len(cases):.2f}",
        )  # fmt: skip
        assert steps > 0
    Console(width=120).print(table)
