from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from stats.bad_plans import compare_with_list, read_list
from stats.record import Record
from stats.report import TOTAL_VARIATION, WASSERSTEIN, measure_distances, total_variation
from stats.summary import PlanSummary
from tests.stats.conftest import outline


def summary(*plans: FloorPlan) -> PlanSummary:
    found = PlanSummary()
    for plan in plans:
        found.add(plan)
    return found


def test_a_data_set_is_no_distance_from_itself() -> None:
    one = summary(outline("a"), outline("b", 6.0, 5.0, rooms=4))
    assert {d.value for d in measure_distances(one, one)} == {0.0}


def test_distances_of_known_size() -> None:
    one = summary(outline("a", 4.0, 3.0, rooms=2), outline("b", 4.0, 3.0, rooms=4))
    other = summary(outline("c", 4.0, 5.0, rooms=7))
    found = {d.name: d for d in measure_distances(one, other)}
    assert found["source_rooms"].kind == WASSERSTEIN
    assert found["source_rooms"].value == pytest.approx((5 + 3) / 2)
    assert found["source_rooms"].deviations == pytest.approx(4.0), "the first one's deviation is 1"
    assert found["area_m2"].value == pytest.approx(8.0)
    assert found["area_m2"].deviations is None, "nothing to compare with where all are alike"
    assert found["labels"].kind == TOTAL_VARIATION
    assert found["connected_0.20"].value == 0.0


def test_what_one_of_them_lacks_is_left_out(ring_of_rooms: FloorPlan) -> None:
    names = {d.name for d in measure_distances(summary(ring_of_rooms), summary(outline("a")))}
    assert "source_rooms" in names
    assert not names & {"doors", "loops", "door_kinds"}


def test_total_variation() -> None:
    assert total_variation({"a": 3}, {"b": 1}) == 1.0
    assert total_variation({"a": 1, "b": 1}, {"a": 30, "b": 10}) == pytest.approx(0.25)


# A data set beside a list of plans that somebody found unusable.


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
