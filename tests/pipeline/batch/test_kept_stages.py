"""``keep_stages``: a picture of each plan's stages in the data set; plans and data sets without it stay as they are."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from houseexpo.errors import ConfigError
from houseexpo.files import PARTIAL
from pipeline.batch.assemble import BuildResult
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from pipeline.batch.verify import find_damaged_files
from pipeline.inspection import inspect_house
from tests.builders.batch import (
    config_for,
    contents,
    lines,
    one_room,
    run_assemble,
    run_build,
    run_shard,
    sketched,
    three_rooms,
)

PICTURES = {f"stages/{name}.png": f"stages of {name}".encode() for name in "abc"}


@pytest.fixture
def houses(tmp_path: Path) -> Path:
    return three_rooms(tmp_path / "houses")


def keep(sources: Path | list[Path], out: Path, **options: Any) -> BuildResult:
    """Build with pictures of the stages."""
    found = sources if isinstance(sources, list) else [sources]
    return run_build(found, out, keep_stages=True, **{"plan": sketched, **options})


def pictures(out: Path) -> dict[str, bytes]:
    return {name: data for name, data in contents(out).items() if name.startswith("stages/")}


def done(out: Path) -> int:
    """Return how many inputs were done in all runs."""
    return len((out / ".build" / "journal.jsonl").read_bytes().splitlines())


@pytest.mark.slow
def test_the_picture_is_what_inspect_draws_and_the_plan_as_without_it(tmp_path: Path) -> None:
    house = one_room(tmp_path / "house.ply")
    run_build([house], tmp_path / "plain", plan=None, seconds=300.0)
    keep([house], tmp_path / "kept", plan=None, seconds=300.0)
    plain, kept = contents(tmp_path / "plain"), contents(tmp_path / "kept")
    (plan,) = (tmp_path / "plain" / "json").iterdir()
    picture = f"stages/{plan.stem}.png"
    assert kept.keys() - plain.keys() == {picture}
    assert [name for name in plain if plain[name] != kept[name]] == ["manifest.json"]
    inspect_house(config_for([house]), {}, 0, tmp_path / "inspected")
    assert kept[picture] == (tmp_path / "inspected" / "stages.png").read_bytes()


def test_the_option_comes_and_goes_and_nothing_is_planned_twice_for_it(houses: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_build([houses], out)
    plain = contents(out)
    keep(houses, out)
    assert pictures(out) == PICTURES
    assert done(out) == 6  # a plan that was made without its picture is made again
    assert keep(houses, out).unchanged
    run_build([houses], out)
    assert contents(out) == plain
    assert not (out / "stages").exists()
    keep(houses, out)
    assert pictures(out) == PICTURES
    assert done(out) == 6


@pytest.mark.slow
def test_workers_and_shards_give_the_same_bytes(houses: Path, tmp_path: Path) -> None:
    keep(houses, tmp_path / "one")
    keep(houses, tmp_path / "two", workers=2)
    config = config_for([houses], keep_stages=True)
    for shard in ("0/2", "1/2"):
        run_shard(config, tmp_path / "shards", shard, plan=sketched)
    run_assemble(tmp_path / "shards")
    one = contents(tmp_path / "one")
    assert pictures(tmp_path / "one") == PICTURES
    assert one == contents(tmp_path / "two") == contents(tmp_path / "shards")
    with pytest.raises(ConfigError, match="other sources, overrides, pictures"):
        run_shard(config_for([houses]), tmp_path / "shards", "0/2")


@pytest.mark.parametrize("lost", ["data set", "store", "damaged", "both"])
def test_a_picture_that_is_lost_comes_back(houses: Path, tmp_path: Path, lost: str) -> None:
    out = tmp_path / "out"
    keep(houses, out)
    stored = next(f for f in (out / ".build" / "plans").rglob("*") if f.is_file() and f.read_bytes() == b"stages of b")
    if lost == "damaged":
        stored.write_bytes(b"stages of x")
    if lost in {"store", "both"}:
        stored.unlink()
    if lost != "store":
        (out / "stages" / "b.png").unlink()
    keep(houses, out)
    assert pictures(out) == PICTURES
    assert stored.read_bytes() == b"stages of b"
    assert list(find_damaged_files(out)) == []


def test_verify_finds_a_picture_that_was_changed(houses: Path, tmp_path: Path) -> None:
    keep(houses, tmp_path / "out")
    (tmp_path / "out" / "stages" / "a.png").write_bytes(b"painted over")
    (tmp_path / "out" / "stages" / "mine.png").touch()
    found = list(find_damaged_files(tmp_path / "out"))
    assert found == ["stages/a.png: changed since it was written", "stages/mine.png: no build wrote it"]


def test_a_file_that_no_build_wrote_is_refused_and_stays(houses: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    keep(houses, out)
    (out / "stages" / "mine.png").write_bytes(b"mine")
    with pytest.raises(ConfigError, match=r"stages/ holds 1 files that no build wrote \(mine.png\)"):
        keep(houses, out)
    assert (out / "stages" / "mine.png").read_bytes() == b"mine"
    (out / "stages" / "mine.png").unlink()
    (out / "stages" / f"{PARTIAL}b.png").touch()  # an interrupted write left it
    (out / "stages" / "b.png").unlink()
    keep(houses, out)
    assert pictures(out) == PICTURES


def test_a_house_that_is_gone_a_copy_and_an_id_that_is_taken(tmp_path: Path) -> None:
    street, out = tmp_path / "street", tmp_path / "out"
    one_room(street / "a.ply", 5.0, 4.0)
    one_room(street / "b.ply", 4.0, 5.0)  # a copy of the first one, turned
    one_room(street / "c.d.ply", 7.0)
    one_room(street / "c" / "d.ply", 9.0)  # both are c_d
    keep(street, out)
    assert [line["id"] for line in lines(out / "duplicates.jsonl")] == ["b"]
    plans = {f"stages/{file.stem}.png" for file in (out / "json").iterdir()}
    assert len(plans) == 3
    assert pictures(out).keys() == plans
    assert sorted(pictures(out).values()) == [b"stages of a", b"stages of c_d", b"stages of c_d"]
    (street / "c.d.ply").unlink()
    keep(street, out)
    assert pictures(out).keys() == {"stages/a.png", "stages/c_d.png"}


@pytest.mark.slow
def test_a_plan_of_another_source_stays_where_its_picture_is_lost(houses: Path, tmp_path: Path) -> None:
    out, other = tmp_path / "out", one_room(tmp_path / "other" / "z.ply", 12.0)
    add = partial(keep, houses, out, others=ExistingPlansPolicy.ADD)
    keep([other], out)
    name = next(iter(pictures(out))).removeprefix("stages/").removesuffix(".png")
    add()
    assert pictures(out).keys() == {*PICTURES, f"stages/{name}.png"}
    for file in [*(out / ".build" / "plans").rglob("*"), *(out / "stages").iterdir()]:
        if file.is_file() and file.read_bytes() == f"stages of {name}".encode():
            file.unlink()
    add()
    assert pictures(out) == PICTURES
    assert (out / "json" / f"{name}.json").exists()
