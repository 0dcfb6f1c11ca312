"""The corrections that the guide shows improve the house that it names."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.dataset import open_dataset
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.overrides import load_overrides
from tests.builders.batch import run_build
from tests.builders.bungalow import BEDROOM_DOOR, FILE, PATIO, ROOMS_M2, write_bungalow

OVERRIDES = FILE.parents[1] / "corrections.toml"
GUIDE = Path(__file__).resolve().parents[2] / "docs" / "guide-pipeline.md"


def built(out: Path, *, corrected: bool) -> FloorPlan:
    overrides = load_overrides(None, OVERRIDES) if corrected else {}
    run_build([FILE], out, plan=plan_level, overrides=overrides)
    return open_dataset(out)[0]


def test_the_example_improves_the_house(tmp_path: Path) -> None:
    before, after = built(tmp_path / "before", corrected=False), built(tmp_path / "after", corrected=True)
    assert [door.kind for door in before.doors].count("cut") == 1
    assert len(before.rooms) == 3
    assert before.quality is not None
    assert before.quality.is_doubtful
    assert sorted((room.area for room in after.rooms), reverse=True) == pytest.approx(ROOMS_M2, abs=0.05)
    assert sorted(door.kind for door in after.doors) == ["door", "entrance", "entrance"]
    assert after.quality is not None
    assert not after.quality.is_doubtful


def test_the_example_says_what_is_true_of_the_house(tmp_path: Path) -> None:
    (override,) = load_overrides(None, OVERRIDES).values()
    assert override.door == (BEDROOM_DOOR,)
    assert override.no_room == (PATIO,)
    assert write_bungalow(tmp_path / "bungalow.obj").read_bytes() == FILE.read_bytes()


def test_the_guide_shows_the_example_as_it_is() -> None:
    assert f"```toml\n{OVERRIDES.read_text()}```" in GUIDE.read_text()
