"""The parts of a release: no house and no copy of one on both sides; what a row of its tables says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from houseexpo.commands.split import split as split_command
from houseexpo.dataset import open_dataset
from houseexpo.errors import DatasetError
from houseexpo.plan.json_codec import encode
from houseexpo.release import release
from houseexpo.release.splits import release_splits
from houseexpo.release.tables import PLANS, ReleasePlan
from tests.builders.plan_files import house, pack
from tests.builders.services import two_rooms

LISTS = {"train": "a\nb\n", "val": "", "test": "c\n"}


def _with_lists(folder: Path, lists: dict[str, str]) -> Path:
    (folder / "splits").mkdir(exist_ok=True)
    for name, text in lists.items():
        (folder / "splits" / f"{name}.txt").write_text(text)
    return folder


def test_levels_and_copies_of_a_house_stay_together(tmp_path: Path) -> None:
    members = {
        **{f"h{i}": encode(house(f"h{i}", 4.0 + i)) for i in range(20)},
        "h3_L1": encode(house("h3_L1", 31.5)),
        "copy": encode(house("copy", 9.0)),
    }
    parts = release_splits(open_dataset(pack(tmp_path, "nested", members)))
    part_of = {name: part for part, ids in parts.lists.items() for name in ids}
    assert sorted(part_of) == sorted(members)
    assert part_of["h3"] == part_of["h3_L1"]
    assert part_of["h5"] == part_of["copy"]
    assert parts.group_of["h3_L1"] == parts.group_of["h3"] == "h3"
    assert parts.groups == 2
    assert list(parts.lists) == ["train", "val", "test"]


def test_lists_of_ones_own_are_taken(rooms: Path, tmp_path: Path) -> None:
    out = release(_with_lists(rooms, LISTS), tmp_path / "out").folder
    assert pq.read_table(out / "plans" / "train.parquet").column("id").to_pylist() == ["a", "b"]
    assert pq.read_table(out / "plans" / "test.parquet").column("split").to_pylist() == ["test"]
    assert not (out / "plans" / "val.parquet").exists()
    assert open_dataset(out).split("train").ids == ["a", "b"]


def test_lists_of_houseexpo_split_are_taken(rooms: Path, tmp_path: Path) -> None:
    split_command(rooms, 0.34, None, 0.66, paper=False, seed=5, out=None, workers=1)
    out = release(rooms, tmp_path / "out").folder
    assert open_dataset(out).splits == open_dataset(rooms).splits


@pytest.mark.parametrize(
    ("lists", "expected"),
    [
        ({"train": "a\nb\n", "test": "b\nc\n"}, "found 1 id otherwise, 'b' in 2"),
        ({"train": "a\n", "test": "c\n"}, "found 1 id otherwise, 'b' in 0"),
        ({"train": "a\nb\nz\n", "test": "c\n"}, "'z' in 1"),
        ({"all": "a\nb\nc\n"}, "expected lists named by letters"),
        ({"tr-ain": "a\nb\nc\n"}, "expected lists named by letters"),
    ],
)
def test_lists_that_do_not_divide_are_refused(
    rooms: Path, tmp_path: Path, lists: dict[str, str], expected: str
) -> None:
    with pytest.raises(DatasetError, match=expected):
        release(_with_lists(rooms, lists), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_lists_that_part_a_house_are_refused(tmp_path: Path) -> None:
    members = {name: encode(house(name, width)) for name, width in (("a", 4.0), ("a_L1", 7.0), ("b", 10.0))}
    folder = _with_lists(pack(tmp_path, "nested", members), {"train": "a\nb\n", "test": "a_L1\n"})
    with pytest.raises(DatasetError, match="found a, a_L1 in test and train; run houseexpo split again"):
        release_splits(open_dataset(folder))


@pytest.mark.parametrize(("words", "count"), [("stairs", 1), ("Main Staircase", 1), ("Upstairs landing", 0)])
def test_stairs_are_what_the_source_calls_so(words: str, count: int) -> None:
    plan = two_rooms("a")
    plan = replace(plan, rooms=(plan.rooms[0], replace(plan.rooms[1], source_labels=(words,))))
    (row,) = PLANS.rows(ReleasePlan(plan, "train", "a", b"", None))
    assert row["stairs"] == count
