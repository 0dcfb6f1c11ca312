"""How many houses of each kind of the kit meet the table of what must hold, and what fails most.

``make bench`` runs 100 members a kind. While developing, e.g.::

    python -m pytest -s tests/benchmarks/test_bench_kinds.py --benchmarks --members 10 --kinds solids,front3d --keep out
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from pipeline.executors.local import Failure, Limits, run
from tests.builders.kinds.measuring import Outcome, measure
from tests.builders.kinds.registry import KINDS
from tests.builders.shared import needs_shared

WORKERS = 2
LIMITS = Limits(seconds=60.0, memory=8 << 30)
SURE = 0.8
"""A plan of this quality should be right."""


def outcomes(kinds: list[str], members: int, seed: int, folder: Path, keep: str) -> Iterator[Outcome]:
    """Measure members in worker processes; one that dies or takes too long is an outcome too."""
    tasks = [(kind, number) for kind in kinds for number in range(members)]
    work = partial(_measured, seed=seed, folder=folder, keep=keep)
    for task, result in run(work, tasks, workers=WORKERS, limits=LIMITS):
        failed = isinstance(result, Failure)
        yield Outcome(*task, (result.kind,), LIMITS.seconds, detail=result.detail) if failed else result


def _measured(task: tuple[str, int], seed: int, folder: Path, keep: str) -> Outcome:
    kind, number = task
    return measure(kind, number, seed, str(folder / kind), keep and f"{keep}/{kind}")


@needs_shared
def test_the_kinds_against_the_table(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    found: dict[str, list[Outcome]] = {kind: [] for kind in kinds}
    console = Console(width=150)
    for outcome in outcomes(kinds, option("--members"), option("--seed"), tmp_path, option("--keep") or ""):
        found[outcome.kind].append(outcome)
        if not outcome.met:
            console.print(
                f"{outcome.kind} {outcome.number}: {', '.join(outcome.failing)}; {outcome.detail}", style="dim"
            )
    console.print(table(found, option("--seed")))
    console.print(certainty([pair for made in found.values() for outcome in made for pair in outcome.qualities]))
    assert all(len(made) == option("--members") for made in found.values())


def table(found: dict[str, list[Outcome]], seed: int) -> Table:
    """One row a kind."""
    made = Table(title=f"Houses of each kind that meet the table (seed {seed})")
    for k, heading in enumerate(("kind", "met", "of", "fails most", "median s", "longest s")):
        made.add_column(heading, justify="left" if k in {0, 3} else "right")
    for kind, results in found.items():
        failing = Counter(column for outcome in results for column in outcome.failing)
        most = ", ".join(f"{column} {count}" for column, count in failing.most_common(4))
        seconds = [outcome.seconds for outcome in results]
        median, longest = (f"{f(seconds):.2f}" for f in (np.median, np.max))
        made.add_row(kind, str(sum(o.met for o in results)), str(len(results)), most, median, longest)
    return made


def certainty(pairs: list[tuple[float | None, bool]]) -> str:
    """What the plans' own quality is worth: how many of the sure ones are right, how well it tells right from wrong."""
    known = [(quality, met) for quality, met in pairs if quality is not None]
    sure = [met for quality, met in known if quality >= SURE]
    good, bad = ([quality for quality, met in known if met is wanted] for wanted in (True, False))
    if not good or not bad:
        return f"quality: {len(known)} plans have one, too alike to judge it"
    wins = np.mean([[1.0 if g > b else 0.5 if g == b else 0.0 for b in bad] for g in good])
    return (
        f"quality of {SURE} or more: {sum(sure)} of {len(sure)} plans meet the table; area under the curve {wins:.3f}"
    )
