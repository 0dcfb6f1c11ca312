"""How many steps a second the simulator makes.

The policy goes forward (0.8) and turns left when it is blocked: one that keeps moving. Houses are two published ones of
57 and 117 m2, the original's; obstacles are drawn anew at each reset, every 200 steps. Rates are medians of rounds in
which all runs take turns.
"""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from houseexpo import FloorPlan
from houseexpo.processes import count_cores
from tests.benchmarks.vector_runs import LEAST, ORIGINAL, ROUNDS, RULES, N, configured, in_turns, single_run, vector_run
from tests.builders.shared import needs_shared


@needs_shared
def test_steps_a_second(houses: list[FloorPlan]) -> None:
    table = Table(title=f"Environment steps a second, {N} environments, copies of observations, resets included")
    for heading in ("configuration", "scan", "view", "original", "1 core", "2 cores", "asked, 1 core", "alone"):
        table.add_column(heading, justify="left" if heading in {"configuration", "scan"} else "right")
    for name, original in ORIGINAL.items():
        for rule in RULES:
            threads = [vector_run(name, rule, houses, number) for number in (1, min(count_cores(), 2))]
            found = in_turns(*threads, single_run(name, rule, houses), rounds=ROUNDS)
            one, two, alone = np.median(found, axis=0)
            side = configured(name, rule).side_px
            table.add_row(
                name,
                rule,
                f"{side} x {side}",
                original,
                f"{one:,.0f}",
                f"{two:,.0f}",
                f"{LEAST[name]:,}",
                f"{alone:,.0f}",
            )
            assert one > 1000
    table.caption = "alone: one environment through gymnasium.make (asked: 5,000 in the first configuration)"
    Console(width=150).print(table)
