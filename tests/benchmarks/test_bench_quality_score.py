"""How well the quality that a plan carries tells plans that meet the table from those that do not, by kind.

Plans of houses on which the model was not fitted stand in a row of their own. ``--members`` and ``--kinds`` choose
houses of the kit as they do for the benchmark of the kinds; the cases of the development data are among them.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from research.quality_fit import by_kind, quality_table
from tests.builders.judged import judged
from tests.builders.kinds.registry import KINDS
from tests.builders.quality_model import NAMES, met_of, split
from tests.builders.shared import needs_shared


@needs_shared
def test_quality_tells_right_plans_from_wrong_ones(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    option = request.config.getoption
    kinds = option("--kinds").split(",") if option("--kinds") else list(KINDS)
    plans = list(judged(kinds, option("--members"), option("--seed"), tmp_path))
    _, held_out = split(plans)
    rows = {"all": met_of(plans), "held out": met_of(held_out), **by_kind(plans)}
    Console(width=120).print(quality_table(rows))
    assert plans
    assert {name for plan in plans for name in plan.grounds} >= set(NAMES), "a ground that no plan gives weighs nothing"
