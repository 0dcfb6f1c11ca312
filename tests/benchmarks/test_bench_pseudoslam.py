"""How many steps a second the simulator makes, and where the time goes.

The policy goes forward (0.8) and turns left when it is blocked: one that keeps moving. Houses are two published ones of
57 and 117 m2, the original's; obstacles are drawn anew at each reset, every 200 steps. Rates are medians of 9
or 21 rounds, in which all runs take turns. Beside what two threads make of one stands what two processes make of one,
each with half of the environments and nothing in common: that is what two cores of this machine, which others may
share, gave just then.
"""

from __future__ import annotations

import os

import numpy as np
from rich.console import Console
from rich.table import Table

import houseexpo.pseudoslam
from houseexpo import FloorPlan
from houseexpo.pseudoslam.step_kernels import make_step_params
from tests.benchmarks.vector_runs import (
    LEAST,
    ORIGINAL,
    ROUNDS,
    RULES,
    N,
    batch_of,
    configured,
    in_turns,
    kernel_run,
    processes,
    rates,
    single_run,
    straightforward,
    vector_run,
)
from tests.builders.shared import needs_shared


@needs_shared
def test_steps_a_second(houses: list[FloorPlan]) -> None:
    table = Table(title=f"Environment steps a second, {N} environments, copies of observations, resets included")
    for heading in (
        "configuration",
        "scan",
        "view",
        "original",
        "1 core",
        "2 cores",
        "ratio",
        "2 processes",
        "asked, 1 core",
        "alone",
    ):
        table.add_column(heading, justify="left" if heading in {"configuration", "scan"} else "right")
    cores = len(os.sched_getaffinity(0))
    for name, original in ORIGINAL.items():
        for rule in RULES:
            threads = [vector_run(name, rule, houses, number) for number in (1, min(cores, 2))]
            with processes(name, rule, houses) as programs:
                found = in_turns(*threads, *programs, single_run(name, rule, houses), rounds=ROUNDS)
            one, two, _, _, alone = np.median(found, axis=0)
            two = two if cores > 1 else float("nan")
            ratio, machine = np.median(found[:, [1, 3]] / found[:, [0, 2]], axis=0)
            side = configured(name, rule).side_px
            table.add_row(
                name, rule, f"{side} x {side}", original, f"{one:,.0f}", f"{two:,.0f}", f"{ratio:.2f}",
                f"{machine:.2f}", f"{LEAST[name]:,}", f"{alone:,.0f}",
            )  # fmt: skip
            assert one > 1000
    table.caption = (
        "ratio: two threads against one, median of the rounds; 2 processes: so for programs with nothing in common\n"
        "alone: one environment through gymnasium.make (asked: 5,000 in the first configuration)"
    )
    Console(width=150).print(table)
    assert houseexpo.pseudoslam.__all__


@needs_shared
def test_beside_a_straightforward_kernel(houses: list[FloorPlan]) -> None:
    table = Table(title="The batched kernel beside a straightforward one (rays), one core, steps a second")
    for heading in ("configuration", "straightforward", "rays", "ratio", "sector", "ratio"):
        table.add_column(heading, justify="left" if heading == "configuration" else "right")
    for name in ("exploration", "autonomous exploration"):
        config = configured(name, "rays")
        one, other = batch_of(config, houses), batch_of(config, houses)
        for k in range(30):
            motions = np.tile((0.1, 0.0) if k % 3 else (0.0, 3.0), (N, 1))
            one.step(motions, np.ones(N, np.uint8))
            straightforward(other.arrays, other.sizes, motions, make_step_params(config))
        assert (one.arrays.known == other.arrays.known).all()
        params = make_step_params(config)
        slow, rays, sector = rates(
            kernel_run(config, houses, lambda b, m, r=params: straightforward(b.arrays, b.sizes, m, r)),
            *(
                kernel_run(configured(name, rule), houses, lambda b, m: b.step(m, np.ones(N, np.uint8)))
                for rule in ("rays", "sector")
            ),
        )
        table.add_row(
            name, f"{slow:,.0f}", f"{rays:,.0f}", f"{rays / slow:.2f}", f"{sector:,.0f}", f"{sector / slow:.2f}"
        )
    Console(width=120).print(table)
