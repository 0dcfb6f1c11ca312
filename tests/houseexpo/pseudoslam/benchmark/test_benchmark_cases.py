"""Which plans are taken: those that a robot can cross, none that repeats another; and from where."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.benchmark.cases import (
    choose_plan_ids,
    content_sha256,
    ids_sha256,
    make_cases,
    make_room_cases,
    read_test_ids,
    seed_from_words,
)
from tests.builders.shared import DATA, needs_shared
from tests.builders.simulations import hut

PUBLISHED = DATA / "houseexpo" / "plans_33717.jsonl.gz"


def pinched(plan_id: str) -> FloorPlan:
    """Two rooms of 3 x 3 m, and a gap of 0.3 m between them: too narrow for a robot of 0.2 m radius."""
    left = [(0, 0), (0, 3), (3, 3), (3, 1.65), (3.1, 1.65), (3.1, 3)]
    right = [(6.1, 3), (6.1, 0), (3.1, 0), (3.1, 1.35), (3, 1.35), (3, 0)]
    return FloorPlan(plan_id, left + right, 2, {})


def turned(plan: FloorPlan, plan_id: str) -> FloorPlan:
    return FloorPlan(plan_id, [(-y, x) for x, y in plan.verts], 1, {})


def data_set(folder: Path, plans: dict[str, list[FloorPlan]]) -> Dataset:
    (folder / "json").mkdir(parents=True)
    for name, houses in plans.items():
        (folder / f"map_id_{name}.txt").write_text("".join(f"{house.id}\n" for house in houses))
        for house in houses:
            (folder / "json" / f"{house.id}.json").write_bytes(encode(house))
    return open_dataset(folder)


@pytest.fixture
def plans(tmp_path: Path) -> Dataset:
    train = [hut("train_a", 4.0), hut("train_b", 7.0)]
    test = [
        hut("own_a", 3.0),
        hut("own_b", 5.0),
        hut("own_c", 6.0),
        hut("own_copy_b", 5.0),  # of a plan of the same list
        turned(train[0], "copy_of_train"),
        pinched("pinched"),
    ]
    return data_set(tmp_path / "plans", {"train": train, "test": test})


def test_copies_and_what_cannot_be_crossed_are_passed_over(plans: Dataset) -> None:
    found = choose_plan_ids(plans, "test", 3)
    assert {"own_a", "own_c"} < set(found)
    assert len({"own_b", "own_copy_b"} & set(found)) == 1


def test_fewer_plans_are_the_first_of_more(plans: Dataset) -> None:
    assert choose_plan_ids(plans, "test", 2) == choose_plan_ids(plans, "test", 3)[:2]


def test_all_there_are_will_do_where_nobody_gave_a_number(plans: Dataset) -> None:
    assert choose_plan_ids(plans, "test", 500, fewer=True) == choose_plan_ids(plans, "test", 3)
    with pytest.raises(ConfigError, match=r"--plans 500: list 'test' of .* has 3 plans"):
        choose_plan_ids(plans, "test", 500)


def test_the_largest_are_chosen_by_area_and_ordered_by_hash(plans: Dataset) -> None:
    """own_c is larger than own_b and its copy, these than own_a."""
    assert choose_plan_ids(plans, "test", 1, largest=1) == ["own_c"]
    two = choose_plan_ids(plans, "test", 2, largest=2)
    assert two[0] in choose_plan_ids(plans, "test", 1, largest=2)
    assert "own_c" in two
    assert len({"own_b", "own_copy_b"} & set(two)) == 1
    assert two == sorted(two, key=lambda name: hashlib.sha256(name.encode()).digest())
    assert choose_plan_ids(plans, "test", 3, largest=500) == choose_plan_ids(plans, "test", 3)
    with pytest.raises(ConfigError, match=r"--plans 3: this track has the 2 largest plans"):
        choose_plan_ids(plans, "test", 3, largest=2)


def test_the_order_of_the_list_makes_no_difference(plans: Dataset, tmp_path: Path) -> None:
    before = choose_plan_ids(plans, "test", 3)
    listed = tmp_path / "plans" / "map_id_test.txt"
    listed.write_text("".join(sorted(listed.read_text().splitlines(keepends=True), reverse=True)))
    assert choose_plan_ids(open_dataset(tmp_path / "plans"), "test", 3) == before


def test_too_few_plans_and_no_list_are_refused(plans: Dataset) -> None:
    with pytest.raises(ConfigError, match=r"--plans 4: list 'test' of .* has 3 plans that a robot of 0.2 m can cross"):
        choose_plan_ids(plans, "test", 4)
    with pytest.raises(DatasetError, match="expected a list 'val' of plans, found: test, train"):
        choose_plan_ids(plans, "val", 1)


def test_a_seed_depends_on_track_and_plan_alone() -> None:
    one, other = make_cases("some-v1", ["a", "b"]), make_cases("some-v1", ["b"])
    assert one[1] == other[0]
    assert one[0].seed != one[1].seed != make_cases("some-v2", ["b"])[0].seed
    assert 0 <= seed_from_words("x") < 2**32
    assert len({case.seed for case in make_room_cases("some-v1", "room", 50)}) == 50


def test_the_hash_is_that_of_a_file_of_ids(tmp_path: Path) -> None:
    (tmp_path / "ids.txt").write_text("a\nb\n")
    assert ids_sha256(["a", "b"]) == hashlib.sha256((tmp_path / "ids.txt").read_bytes()).hexdigest()


def test_other_walls_have_another_hash(tmp_path: Path) -> None:
    one = data_set(tmp_path / "one", {"test": [hut("a", 4.0)]})
    other = data_set(tmp_path / "other", {"test": [hut("a", 4.1)]})
    assert content_sha256(one) != content_sha256(other)
    assert content_sha256(one) == content_sha256(open_dataset(tmp_path / "one"))


def test_the_list_that_is_written_down_is_a_list() -> None:
    ids = read_test_ids()
    assert len(ids) == len(set(ids)) == 1000


@needs_shared
@pytest.mark.slow
def test_the_published_list_is_taken_as_it_is_written_down() -> None:
    plans = open_dataset(PUBLISHED)
    assert choose_plan_ids(plans, "test", 500) == list(read_test_ids()[:500])
    assert set(read_test_ids()) <= set(plans.splits["test"])
