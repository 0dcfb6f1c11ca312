"""How a build again ends, with a build that does what the test says: what it counts as built, and what goes wrong."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("starlette")

from houseexpo.dataset.build_record import BuildCommand, BuildRecord, write_build_record
from houseexpo.errors import ConfigError
from houseexpo.service.collection import Collection
from houseexpo.service.review.decisions import DecisionStore
from houseexpo.service.review.rebuild import Rebuild, compare_decided_plans
from tests.builders.services import built, some_plans, two_rooms

Begun = Callable[[str], Rebuild]


@pytest.fixture
def decisions(tmp_path: Path) -> DecisionStore:
    return DecisionStore(tmp_path / "overrides.toml")


@pytest.fixture
def begun(tmp_path: Path, decisions: DecisionStore, monkeypatch: pytest.MonkeyPatch) -> Begun:
    """Begin to build with a shell script in the place of Python."""
    folder = built(tmp_path / "homes", some_plans())
    (folder / ".build").mkdir()
    write_build_record(folder, BuildRecord(BuildCommand(("houses",))))

    def start(script: str) -> Rebuild:
        python = tmp_path / "python"
        python.write_text(f"#!/bin/sh\n{script}\n")
        python.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(python))
        found = Rebuild(Collection("homes", folder), decisions)
        found.start("ann", found.status()["confirm"])
        return found

    return start


def ended(building: Rebuild) -> str:
    for _ in range(600):
        if building.phase != "building":
            return building.phase
        time.sleep(0.05)
    raise TimeoutError(building.status())


def test_what_is_decided_while_it_is_built_waits_for_the_next_build(
    tmp_path: Path, decisions: DecisionStore, begun: Begun
) -> None:
    decisions.decide("a1", "keep", "ann")
    # R3
    building = begun(f"while [ ! -e {tmp_path / 'go'} ]; do sleep 0.05; done")
    decisions.decide("b2", "drop", "ben")
    (tmp_path / "go").touch()
    assert ended(building) == "built"
    assert [outcome.plan for outcome in building.outcomes] == ["a1"]
    assert decisions.since_build() == ["b2"]
    assert DecisionStore(decisions.file).since_build() == ["b2"]


def test_a_house_that_had_no_plan_and_has_none_is_not_gone(decisions: DecisionStore, begun: Begun) -> None:
    decisions.decide("shed", "keep", "ann")
    building = begun("exit 0")
    assert ended(building) == "built"
    (outcome,) = building.outcomes
    assert (outcome.plan, outcome.became, outcome.why) == ("shed", "no plan", "too small: 2.1 m2")


def test_the_plans_that_came_instead_of_a_house_are_named(tmp_path: Path) -> None:
    folder = built(tmp_path / "homes", [two_rooms("level0_B1"), two_rooms("level0_B2", 5.0), two_rooms("level01", 6.0)])
    found = compare_decided_plans(folder, {}, ["level0"])
    assert [(each.plan, each.became) for each in found] == [("level0_B1", "new"), ("level0_B2", "new")]
    assert compare_decided_plans(folder, {}, ["level"])[0].why == "it is not in the data set"


def test_a_first_decision_while_it_is_built_waits_too(tmp_path: Path, decisions: DecisionStore, begun: Begun) -> None:
    building = begun(f"while [ ! -e {tmp_path / 'go'} ]; do sleep 0.05; done")
    decisions.decide("b2", "drop", "ben")
    (tmp_path / "go").touch()
    assert ended(building) == "built"
    assert decisions.since_build() == ["b2"]


def test_a_build_that_cannot_be_started_leaves_the_next_one_free(
    begun: Begun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    building = begun("exit 0")
    assert ended(building) == "built"
    monkeypatch.setattr(sys, "executable", str(tmp_path / "gone"))
    with pytest.raises(ConfigError, match="cannot be started"):
        building.start("ann", building.status()["confirm"])
    assert building.phase == "built"


def test_whatever_fails_at_the_end_is_said_and_ends_it(begun: Begun, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ValueError("odd bytes")

    monkeypatch.setattr("houseexpo.service.review.rebuild.compare_decided_plans", broken)
    building = begun("exit 0")
    assert ended(building) == "failed"
    assert building.status()["lines"] == ["ValueError: odd bytes"]


def test_stopping_what_has_just_ended_is_no_error(begun: Begun, monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(*_: object) -> None:
        raise ProcessLookupError

    building = begun("sleep 1")
    with monkeypatch.context() as patch:
        patch.setattr("os.killpg", gone)
        building.stop()
    assert ended(building) == "built"
