"""Pairs of maps that `houseexpo observe` makes a second, of published plans; asked: a million an hour, two cores."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from houseexpo import open_dataset
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.io.observe import observe
from houseexpo.pseudoslam.io.pairs import USUAL_NOISE, PairConfig
from houseexpo.workers import cores
from tests.builders.shared import DATA, needs_shared

PLANS = DATA / "houseexpo" / "plans_33717.jsonl.gz"
EACH, PAIRS = 30, 12_000  # a million pairs are 30 of each plan
ASKED = 1_000_000 / 3600
RUNS = {
    "with rooms": PairConfig(each=EACH),
    "without rooms": PairConfig(each=EACH, rooms=False),
    "with rooms and noise": PairConfig(each=EACH, simulator=SimulatorConfig(noise=USUAL_NOISE)),
}

pytestmark = needs_shared


def test_pairs_a_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On all cores, unprepared: each house is made when it is visited."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    plans = open_dataset(PLANS)
    observe(plans, tmp_path / "warm", PairConfig(each=2), limit=4)  # compiled, and the data set packed
    table = Table("", "pairs/s", "a million, minutes", "bytes a pair", title=f"Pairs of maps, {cores()} processes")
    for name, config in RUNS.items():
        start = time.perf_counter()
        done = observe(plans, tmp_path / name, config, limit=PAIRS, seed=1, workers=cores())
        rate = done.pairs / (time.perf_counter() - start)
        table.add_row(name, f"{rate:,.0f}", f"{1e6 / rate / 60:.0f}", f"{done.size / done.pairs:,.0f}")
        with np.load(next((tmp_path / name).glob("pairs-*.npz"))) as arrays:
            assert len(arrays["partial"])
    Console().print(table, f"asked: {ASKED:.0f} pairs/s")
