from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from stats.bad_plans import compare_with_list, read_list
from stats.record import Record


def record(name: str, components: int) -> Record:
    return Record(name, {}, {}, {}, {"0.20": (components, 1.0, 0.8)}, None, name, name)


def test_precision_and_recall() -> None:
    records = [record("good", 1), record("seen", 2), record("only_measured", 3), record("none_fits", 0)]
    verdict = compare_with_list(records, frozenset({"seen", "good", "gone"}), "list.txt")
    assert verdict.both == ("seen",)
    assert verdict.measured_only == ("none_fits", "only_measured")
    assert verdict.listed_only == ("good",)
    assert verdict.unknown == 1
    assert verdict.precision == pytest.approx(1 / 3)
    assert verdict.recall == pytest.approx(1 / 2)


def test_ten_of_each_kind_are_drawn_the_same_every_time() -> None:
    records = [record(f"bad{i:02}", 2) for i in range(30)]
    verdict = compare_with_list(records, frozenset({"x"}), "list.txt")
    some, other = verdict.sample()
    assert len(set(some)) == 10
    assert other == []
    assert verdict.sample() == (some, other)
    assert verdict.recall == 0.0


def test_lists_are_read_with_and_without_the_suffix(tmp_path: Path) -> None:
    path = tmp_path / "bad.txt"
    path.write_text("a.json\nb\na.json\n\n")
    assert read_list(path) == {"a", "b"}


def test_a_list_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "empty.txt").touch()
    with pytest.raises(ConfigError, match="found none"):
        read_list(tmp_path / "empty.txt")
    with pytest.raises(ConfigError, match="text file"):
        read_list(tmp_path / "absent.txt")
