"""What is decided is on the disk when it is answered, whoever else decides, and whatever happens then."""

from __future__ import annotations

import os
import signal
import tomllib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import msgspec
import pytest

from houseexpo.corrections import Override
from houseexpo.corrections.decision_log import LogLine
from houseexpo.errors import ConfigError
from houseexpo.service.review.changes import DecidedOtherwiseError
from houseexpo.service.review.decisions import DecisionStore
from tests.builders.services import clerk

DOOR = [[1.0, 2.0], [1.0, 2.9]]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "overrides.toml"


def tables(file: Path) -> dict[str, dict[str, object]]:
    return tomllib.loads(file.read_text())


def lines(file: Path) -> list[LogLine]:
    return [
        msgspec.json.decode(line, type=LogLine) for line in file.with_suffix(".log.jsonl").read_bytes().splitlines()
    ]


def test_decisions_stand_in_the_file_and_in_the_log(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "door", "ann", DOOR)
    decisions.decide("villa", "door", "ann", [[3.0, 2.0], [4.0, 2.0]], seen=1)
    decisions.decide("villa", "no_room", "ann", [5.0, 5.0], seen=2)
    decisions.decide("hall", "drop", "ben", "a hall")
    assert tables(file) == {
        "villa": {"door": [DOOR, [[3.0, 2.0], [4.0, 2.0]]], "no_room": [5.0, 5.0]},
        "hall": {"drop": True, "why": "a hall"},
    }
    assert [(line.number, line.reviewer, line.plan, line.action) for line in lines(file)] == [
        (1, "ann", "villa", "door"),
        (2, "ann", "villa", "door"),
        (3, "ann", "villa", "no_room"),
        (4, "ben", "hall", "drop"),
    ]
    assert decisions.by_plan()["villa"].actions == ("door", "door", "no_room")


def test_a_file_from_windows_with_a_byte_order_mark_is_gone_on_with(file: Path) -> None:
    file.write_bytes(b'\xef\xbb\xbf[villa]\nlabel = [5.0, 5.0, "Kitchen"]\n')
    DecisionStore(file).decide("villa", "door", "ann", DOOR)
    assert tables(file) == {"villa": {"label": [5.0, 5.0, "Kitchen"], "door": DOOR}}


def test_keep_and_drop_take_each_others_place_and_a_note_may_go(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "drop", "ann")
    decisions.decide("villa", "note", "ann", "odd", seen=1)
    decisions.decide("villa", "keep", "ann", seen=2)
    assert tables(file) == {"villa": {"keep": True, "why": "odd"}}
    decisions.decide("villa", "note", "ann", "", seen=3)
    assert tables(file) == {"villa": {"keep": True}}


def test_undo_takes_back_ones_own_latest_and_is_a_line_of_its_own(file: Path) -> None:
    file.write_text("# by hand\n[hut]\nkeep = true  # seen\n")
    before, decisions = file.read_text(), DecisionStore(file)
    decisions.decide("hut", "drop", "ann")
    decisions.decide("villa", "door", "ann", DOOR)
    decisions.decide("villa", "door", "ben", [[3.0, 2.0], [4.0, 2.0]], seen=2)
    assert decisions.undo("ann").plan == "villa"
    assert tables(file)["villa"] == {"door": [[3.0, 2.0], [4.0, 2.0]]}  # Ben's stays
    assert decisions.undo("ann").plan == "hut"
    decisions.undo("ben")
    assert tables(file) == tomllib.loads(before)
    assert "# by hand" in file.read_text()
    assert "# seen" in file.read_text()
    assert [line.undoes for line in lines(file)] == [0, 0, 0, 2, 1, 3]
    assert decisions.by_plan() == {}
    with pytest.raises(ConfigError, match="ann has no decision left"):
        decisions.undo("ann")


@pytest.mark.parametrize("name", ["ben", "ann"])
def test_what_was_decided_unseen_is_not_overruled_under_whatever_name(file: Path, name: str) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    with pytest.raises(DecidedOtherwiseError, match="ann chose keep in the meantime"):
        decisions.decide("villa", "drop", name)
    assert tables(file) == {"villa": {"keep": True}}


def test_what_somebody_else_decided_is_overruled_once_it_is_seen(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    decisions.decide("villa", "drop", "ben", seen=1)
    assert tables(file) == {"villa": {"drop": True}}
    with pytest.raises(DecidedOtherwiseError, match="somebody changed"):
        decisions.undo("ann")


def test_a_file_changed_by_hand_meanwhile_is_taken_as_it_is(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    file.write_text('# mine\n[villa]\nwhy = "by hand"\n')
    decisions.decide("hall", "drop", "ann")
    assert tables(file) == {"villa": {"why": "by hand"}, "hall": {"drop": True}}


@pytest.mark.parametrize("step", ["before the line", "after the line"])
def test_killed_in_the_middle_it_is_done_or_not_in_both_places(
    file: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    DecisionStore(file).decide("villa", "keep", "ann")

    def killed(*_: object) -> None:
        raise SystemExit

    where = {
        "before the line": "houseexpo.corrections.decision_log.DecisionLog.add",
        "after the line": "pathlib.Path.replace",
    }
    with monkeypatch.context() as patch:
        patch.setattr(where[step], killed)
        with pytest.raises(SystemExit):
            DecisionStore(file).decide("hall", "drop", "ann")
    DecisionStore(file).decide("barn", "keep", "ben")
    noted = "hall" in {line.plan for line in lines(file)}
    assert noted == (step == "after the line")
    assert ("hall" in tables(file)) == noted
    assert not list(file.parent.glob(".partial-*"))


def test_a_line_that_was_cut_off_is_passed_over(file: Path) -> None:
    DecisionStore(file).decide("villa", "keep", "ann")
    with file.with_suffix(".log.jsonl").open("ab") as stream:
        stream.write(b'{"number":2,"time":"20')
    decisions = DecisionStore(file)
    assert decisions.decide("hall", "drop", "ann").number == 2
    assert [line.plan for line in decisions.log.lines] == ["villa", "hall"]
    assert set(DecisionStore(file).by_plan()) == {"villa", "hall"}


def test_without_room_on_the_disk_nothing_changes(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    before = file.read_bytes(), file.with_suffix(".log.jsonl").read_bytes()

    def full_after(synced: int) -> Callable[[int], None]:
        calls = iter(range(9))

        def sync(descriptor: int) -> None:
            if next(calls) == synced:
                raise OSError(28, "No space left on device")

        return sync

    for synced in (0, 1):  # the file's own bytes, and the line's
        with monkeypatch.context() as patch:
            patch.setattr("os.fsync", full_after(synced))
            with pytest.raises(ConfigError, match="No space left"):
                decisions.decide("hall", "drop", "ann")
        assert (file.read_bytes(), file.with_suffix(".log.jsonl").read_bytes()) == before
        assert not list(file.parent.glob(".partial-*"))
    assert decisions.decide("hall", "drop", "ann").number == 2


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be written"):
        DecisionStore(tmp_path / "gone" / "overrides.toml").decide("villa", "keep", "ann")


def test_a_file_that_is_no_toml_is_said_and_left_alone(file: Path) -> None:
    file.write_text("[villa\n")
    with pytest.raises(ConfigError, match="correct the file first"):
        DecisionStore(file).decide("villa", "keep", "ann")
    assert file.read_text() == "[villa\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("villa = 3\n", r"villa: expected a table \[villa\], found 3"),
        ("[[villa]]\nkeep = true\n", r"villa: expected a table \[villa\], found \[\{"),
        ("[villa]\ndoor = 3\n", r"villa: door: expected \[\[x, y\], \[x, y\]\].* found 3"),
        ("[villa]\ndoor = [1.0, 2.0]\n", r"villa: door: expected \[\[x, y\], \[x, y\]\].* found"),
        ('[villa]\nno_room = ["a", "b"]\n', r"villa: no_room: expected \[x, y\].* found"),
        ("[villa]\nno_room = [inf, 2.0]\n", "villa: no_room: expected finite metres, found"),
        ("[villa]\nno_room = [[1.0, 2.0], [3.0]]\n", r"villa: no_room: expected \[x, y\].* found"),
    ],
)
def test_what_a_person_wrote_wrong_of_a_plan_is_said(file: Path, text: str, found: str) -> None:
    decisions = DecisionStore(file)
    line = decisions.decide("villa", "door", "ann", DOOR)
    file.write_text(text)
    for work in (
        lambda: decisions.decide("villa", "door", "ann", DOOR, seen=line.number),
        lambda: decisions.undo("ann"),
    ):
        with pytest.raises(ConfigError, match=rf"overrides\.toml: {found}"):
            work()
    assert decisions.decide("hall", "keep", "ann").plan == "hall"  # the others are not kept from it
    assert text in file.read_text()


@pytest.mark.slow
def test_two_people_at_once_lose_nothing(file: Path) -> None:
    people = [clerk(file, name, 25) for name in ("ann", "ben")]
    answered = {plan for each in people for plan in each.communicate(timeout=60)[0].split()}
    assert len(answered) == 50
    assert set(tables(file)) == answered
    assert [line.number for line in lines(file)] == list(range(1, 51))


@pytest.mark.slow
def test_kill_9_loses_nothing_that_was_answered(file: Path) -> None:
    for count in (3, 8):
        process = clerk(file, f"ann{count}", 1000)
        assert process.stdout is not None
        answered = [process.stdout.readline().strip() for _ in range(count)]
        os.kill(process.pid, signal.SIGKILL)
        answered += process.stdout.read().split()
        process.wait()
        DecisionStore(file).decide(f"next{count}", "keep", "ben")
        assert set(answered) <= set(tables(file))
        assert {line.plan for line in lines(file)} == set(tables(file))


def test_since_a_build_is_what_was_decided_after_it(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    decisions.note_build("ann", decisions.last())
    assert decisions.since_build() == []
    decisions.undo("ann")
    assert decisions.since_build() == ["villa"]


def test_a_build_in_a_terminal_has_the_words_that_its_manifest_states(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "door", "ann", DOOR)
    decisions.decide("villa", "label", "ann", [5.0, 5.0, "Kitchen"], seen=1)
    assert decisions.since_build() == ["villa"]
    made = {"overrides": {"villa": asdict(Override(**tables(file)["villa"]))}}  # type: ignore[arg-type]  # checked there
    (file.parent / "manifest.json").write_bytes(msgspec.json.encode(made))
    assert decisions.since_build() == []
    decisions.decide("villa", "no_room", "ann", [5.0, 5.0], seen=2)
    assert decisions.since_build() == ["villa"]


def test_a_build_in_a_log_of_before_holds_all_that_stands_before_it(file: Path) -> None:
    decisions = DecisionStore(file)
    decisions.decide("villa", "keep", "ann")
    decisions.log.add(LogLine(2, "2026-05-01T00:00:00+00:00", "ann", "", "build"))
    assert decisions.since_build() == []


def test_what_was_undone_is_made_again_until_something_else_is_decided(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    for x in (1.0, 2.0):
        store.decide("a", "no_room", "ann", [x, 1.0], seen=9)
    store.decide("b", "keep", "ben")
    store.undo("ann")
    store.undo("ann")
    assert store.table("a") == {}
    assert [holds for _, holds in store.history("a")] == [False, False]
    store.redo("ann")
    assert store.table("a") == {"no_room": [1.0, 1.0]}
    store.redo("ann")
    assert store.table("a") == {"no_room": [[1.0, 1.0], [2.0, 1.0]]}
    assert [(line.action, holds) for line, holds in store.history("a")] == [("no_room", True), ("no_room", True)]
    with pytest.raises(ConfigError, match="undone nothing"):
        store.redo("ann")
    store.undo("ann")
    store.decide("a", "note", "ann", "seen", seen=99)
    with pytest.raises(ConfigError, match="undone nothing"):
        store.redo("ann")
    assert store.table("b") == {"keep": True}


def test_a_value_is_moved_and_taken_out_and_both_can_be_undone(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    for x in (1.0, 2.0, 3.0):
        store.decide("a", "no_room", "ann", [x, 1.0], seen=9)
    store.replace("a", "no_room", [2.0, 1.0], [2.5, 1.0], reviewer="ann", seen=9)
    assert store.table("a")["no_room"] == [[1.0, 1.0], [2.5, 1.0], [3.0, 1.0]]
    with pytest.raises(DecidedOtherwiseError, match="nobody says this any more"):
        store.replace("a", "no_room", [2.0, 1.0], None, reviewer="ben", seen=9)
    with pytest.raises(DecidedOtherwiseError, match="moved a correction in the meantime"):
        store.replace("a", "no_room", [3.0, 1.0], None, reviewer="ben", seen=3)
    store.replace("a", "no_room", [3.0, 1.0], None, reviewer="ben", seen=9)
    assert store.table("a")["no_room"] == [[1.0, 1.0], [2.5, 1.0]]
    store.undo("ann")  # what ben took out stays out
    assert store.table("a")["no_room"] == [[1.0, 1.0], [2.0, 1.0]]
    store.undo("ben")
    assert store.table("a")["no_room"] == [[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]]


def test_an_undo_on_a_plan_leaves_what_was_decided_on_others(tmp_path: Path) -> None:
    store = DecisionStore(tmp_path / "overrides.toml")
    store.decide("hut", "keep", "ann")
    store.decide("villa", "keep", "ann")
    assert store.undo("ann", ["hut"]).plan == "hut"
    with pytest.raises(ConfigError, match="nothing to undo on this plan; the latest decision is on villa"):
        store.undo("ann", ["hut"])
    assert store.table("villa") == {"keep": True}
