"""Who said what, and when, goes from the log of a review into the provenance of the plan that is built with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from houseexpo.corrections import Override
from houseexpo.corrections.vocabulary import author_key
from houseexpo.errors import ConfigError
from houseexpo.service.review.decisions import DecisionStore
from pipeline.overrides import LevelOverride, load_overrides
from tests.builders.services import two_rooms

DOOR, OTHER = [[0.0, 0.0], [0.0, 0.9]], [[5.0, 0.0], [5.0, 1.0]]


def told(folder: Path, records: list[dict[str, Any]]) -> dict[str, Any]:
    """The provenance of a plan that was built with what a folder's files say."""
    plan = replace(two_rooms("house"), provenance={"corrections": records})
    found = LevelOverride(Override(), load_overrides(None, None, folder)).named(plan).provenance
    assert found is not None
    return dict(found)


def record(word: str, value: Any) -> dict[str, Any]:
    return {"word": word, "value": value, "outcome": "done", "said": "so"}


def test_each_correction_names_who_said_it(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    first = store.decide("house", "door", "ann", DOOR)
    second = store.decide("house", "door", "ben", OTHER, first.number)
    kept = store.decide("house", "keep", "cat", None, second.number)
    found = told(tmp_path, [record("door", DOOR), record("door", OTHER), record("no_room", [1.0, 2.0])])
    assert [(each.get("by"), each.get("at")) for each in found["corrections"]] == [
        ("ann", first.time),
        ("ben", second.time),
        (None, None),
    ]
    assert (found["kept_by"], found["kept_at"]) == ("cat", kept.time)


def test_who_moved_it_said_it_and_who_was_undone_did_not(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    first = store.decide("house", "door", "ann", DOOR)
    store.replace("house", "door", DOOR, OTHER, reviewer="ben", seen=first.number)
    assert told(tmp_path, [record("door", OTHER)])["corrections"][0]["by"] == "ben"
    store.undo("ben")
    assert told(tmp_path, [record("door", DOOR)])["corrections"][0]["by"] == "ann"


def test_words_are_applied_in_the_order_in_which_they_were_said(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    (tmp_path / "overrides.toml").write_text("[house]\nno_room = [9.0, 9.0]\n")
    store.decide("house", "no_door", "ann", [1.0, 2.0])
    second = store.decide("house", "door", "ann", DOOR, 1)

    def order() -> list[str]:
        return [each.word for each in load_overrides(None, None, tmp_path)["house"].corrections]

    store.decide("house", "wall", "ann", [[1.0, 1.0], [2.0, 2.0]], second.number)
    assert order() == ["no_room", "no_door", "door", "wall"]
    store.replace("house", "door", DOOR, OTHER, reviewer="ben", seen=3)
    assert order() == ["no_room", "no_door", "door", "wall"]  # what is moved keeps its place
    store.replace("house", "no_door", [1.0, 2.0], None, reviewer="ben", seen=4)
    store.decide("house", "no_door", "ben", [1.0, 2.0], 5)
    assert order() == ["no_room", "door", "wall", "no_door"]


def test_a_file_without_a_log_names_nobody(tmp_path: Path) -> None:
    (tmp_path / "overrides.toml").write_text("[house]\ndoor = [[0, 0], [0, 0.9]]\n")
    assert told(tmp_path, [record("door", DOOR)])["corrections"] == [record("door", DOOR)]
    (tmp_path / "overrides.log.jsonl").write_text('{"what": 1}\nnothing\n')
    assert told(tmp_path, [record("door", DOOR)])["corrections"] == [record("door", DOOR)]


def test_nobody_writes_authors_by_hand(tmp_path: Path) -> None:
    (tmp_path / "overrides.toml").write_text('[house]\nauthors = [["x", "ann", "now"]]\n')
    with pytest.raises(ConfigError, match=r"authors: unknown key"):
        load_overrides(None, None, tmp_path)


def test_who_kept_one_storey_kept_no_other() -> None:
    words = {
        "house_L0": Override(keep=True, authors=((author_key("keep", True), "ann", "today"),)),
        "house_L1": Override(label=((1.0, 1.0, "Kitchen"),)),
    }
    for level, names in (("house_L0", {"kept_by": "ann", "kept_at": "today"}), ("house_L1", {})):
        found = LevelOverride.of(level, words, "").named(two_rooms(level)).provenance or {}
        assert {key: found[key] for key in found if key.startswith("kept")} == names
