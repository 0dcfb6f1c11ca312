"""The main job in small: houses that the tests make, through the SUNCG reader and every stage."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from houseexpo.floorplan import load_plan
from pipeline.algorithm import plan_level
from tests.builders.batch import contents, run_build
from tests.builders.suncg_houses import scene_id, write_houses


@pytest.mark.slow
def test_made_houses_become_plans_whatever_the_workers(tmp_path: Path) -> None:
    write_houses(tmp_path / "houses", 8, 5)
    house = [tmp_path / "houses"]
    one = run_build(house, tmp_path / "one", workers=1, seed=5, plan=plan_level)
    run_build(house, tmp_path / "two", workers=2, seed=5, plan=plan_level)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    scenes = {scene_id(index, 5) for index in range(8)}
    assert {name.partition("_")[0] for name in one.ids} <= scenes
    assert len(one.ids) >= 5
    rows = pq.read_table(tmp_path / "one" / "index.parquet").to_pylist()
    assert all(row["navigability"]["0.20"]["components"] == 1 for row in rows)
    provenance = load_plan(tmp_path / "one" / "json" / f"{one.ids[0]}.json").provenance or {}
    assert provenance["generator"] == "houseexpo"
    assert not [data for data in contents(tmp_path / "one").values() if b"/tmp" in data]
