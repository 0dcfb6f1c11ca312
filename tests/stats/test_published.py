"""What is known of the published plans."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.dataset import open_dataset
from stats.measure import measure_plans, summarise_records

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "houseexpo"


@pytest.mark.slow
def test_the_published_plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not DATA.exists():
        pytest.skip("the published plans are not on this machine")
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path))
    data_set = open_dataset(DATA / "plans_33717.jsonl.gz")
    measured = measure_plans(data_set)
    found = summarise_records(data_set, measured).whole.report()
    rooms = found["source_rooms"]
    assert (found["count"], rooms["sum"], rooms["median"], rooms["max"]) == (33_717, 250_041, 7, 73)
    assert rooms["mean"] == pytest.approx(7.416, abs=0.0005)
    assert found["label_boxes"]["sum"] == sum(found["labels"].values()) == 242_370
    assert len(found["labels"]) == 25
    rings = found["rings"]
    assert (rings["invalid"], rings["touching"], rings["crossing"]) == (1_285, 713, 572)
    assert (rings["repeats"], rings["groups"], rings["plans_in_groups"], rings["largest_group"]) == (
        614,
        394,
        1008,
        131,
    )
