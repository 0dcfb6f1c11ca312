"""Shards of a build: whichever runs when and how often, what is put together is what one build gives."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

import pytest

from houseexpo.corrections import Override
from houseexpo.dataset.build_record import BuildCommand, BuildRecord, read_build_record
from houseexpo.errors import ConfigError
from pipeline.batch.result_store import FolderStore, open_store
from pipeline.batch.shard_build import begin_shards, require_common_settings, unfinished_inputs
from pipeline.batch.shards import Shard, ShardJournal, read_common_settings, shard_number
from tests.builders.batch import boxed, config_for, contents, killed_once, one_room, run_assemble, run_build, run_shard
from tests.builders.commands import call


def shard_of_a(count: int) -> str:
    return f"{shard_number('a', count)}/{count}"


@pytest.mark.slow
def test_shards_in_any_order_and_more_than_once_give_the_bytes_of_one_build(
    street: Path, serial: dict[str, bytes], tmp_path: Path
) -> None:
    config = config_for([street])
    done = [run_shard(config, tmp_path / "out", f"{number}/3") for number in (2, 0, 1)]
    assert sum(each.inputs for each in done) == 7
    journal = ShardJournal(FolderStore(tmp_path / "out"), None)
    assert len(list(journal.entries())) == 7
    shutil.rmtree(
        next((tmp_path / "out/.build/shards").glob(f"{shard_number('a', 3):06d}-of-*"))
    )  # an attempt that is lost
    assert (
        "a"
        in unfinished_inputs(require_common_settings(str(tmp_path / "out")), str(tmp_path / "out"))[
            shard_number("a", 3)
        ]
    )
    run_shard(config, tmp_path / "out", shard_of_a(3))
    run_assemble(tmp_path / "out")
    assert contents(tmp_path / "out") == serial
    assert run_assemble(tmp_path / "out").unchanged
    assert run_build([street], tmp_path / "out").unchanged  # from here on it is a data set like any other


def test_a_shard_that_was_done_is_not_done_again_unless_an_input_changed(street: Path, tmp_path: Path) -> None:
    houses = shutil.copytree(street, tmp_path / "street")
    config, chunks = config_for([houses]), tmp_path / "out/.build/shards"
    run_shard(config, tmp_path / "out", "0/1")
    before = sorted(chunks.rglob("*.jsonl"))
    run_shard(config, tmp_path / "out", "0/1")
    assert sorted(chunks.rglob("*.jsonl")) == before
    one_room(houses / "c.ply", 9.0)
    assert unfinished_inputs(require_common_settings(str(tmp_path / "out")), str(tmp_path / "out")) == {0: ["c"]}
    run_shard(config, tmp_path / "out", "0/1")
    run_assemble(tmp_path / "out")
    run_build([houses], tmp_path / "afresh")
    assert contents(tmp_path / "out") == contents(tmp_path / "afresh")


def test_a_torn_chunk_costs_what_stood_in_it(street: Path, serial: dict[str, bytes], tmp_path: Path) -> None:
    run_shard(config_for([street]), tmp_path / "out", "0/1")
    [chunk] = (tmp_path / "out/.build/shards").rglob("*.jsonl")
    chunk.write_bytes(chunk.read_bytes()[:-40])
    assert (
        sum(map(len, unfinished_inputs(require_common_settings(str(tmp_path / "out")), str(tmp_path / "out")).values()))
        == 1
    )
    run_shard(config_for([street]), tmp_path / "out", "0/1")
    run_assemble(tmp_path / "out")
    assert contents(tmp_path / "out") == serial


def test_a_worker_that_is_killed_in_a_shard_costs_nothing(
    street: Path, serial: dict[str, bytes], tmp_path: Path
) -> None:
    done = run_shard(config_for([street]), tmp_path / "out", "0/1", plan=partial(killed_once, tmp_path / "mark"))
    assert (tmp_path / "mark").exists()
    assert not done.not_done
    run_assemble(tmp_path / "out")
    assert contents(tmp_path / "out") == serial


def test_a_plan_that_left_the_store_is_left_to_do(street: Path, tmp_path: Path) -> None:
    run_shard(config_for([street]), tmp_path / "out", "0/1")
    next((tmp_path / "out/.build/plans").rglob("*/*")).unlink()
    assert (
        sum(map(len, unfinished_inputs(require_common_settings(str(tmp_path / "out")), str(tmp_path / "out")).values()))
        == 1
    )


def test_assemble_says_which_houses_of_which_shards_are_not_done(
    street: Path, serial: dict[str, bytes], tmp_path: Path
) -> None:
    out, others = tmp_path / "out", f"{(shard_number('a', 2) + 1) % 2}/2"
    run_shard(config_for([street]), out, others, plan=boxed)
    said = call("assemble", out, code=3)
    assert f"shard {shard_of_a(2)}: " in said
    assert "a" in said.split("not done: ")[1]
    assert not (out / "manifest.json").exists()
    call("assemble", out, "--partial", code=3)
    assert "json/a.json" not in contents(out)
    run_shard(config_for([street]), out, shard_of_a(2))
    call("assemble", out)
    assert contents(out) == serial


def test_a_stored_plan_that_was_damaged_is_named_and_nothing_is_written(
    street: Path, serial: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    for number in range(2):
        run_shard(config_for([street]), out, f"{number}/2", plan=boxed)
    before = contents(out)
    stored = sorted(file for file in (out / ".build" / "plans").rglob("*") if file.is_file())
    file = next(each for each in stored if b'"id":"a"' in each.read_bytes())
    file.write_bytes(file.read_bytes().replace(b'"id":"a"', b'"id":"z"'))
    said = call("-q", "assemble", out, code=3)
    assert f"shard {shard_of_a(2)}: damaged: 1 house: a" in said
    assert contents(out) == before
    run_shard(config_for([street]), out, shard_of_a(2))
    call("assemble", out)
    assert contents(out) == serial


@pytest.mark.slow
def test_what_was_assembled_says_how_it_can_be_built_again(tmp_path: Path) -> None:
    words = ["build", "procedural:2", "--seed", "4", "--out", str(tmp_path / "out"), "--workers", "1"]
    for shard in ("1/2", "2/2"):
        done = call(*words, "--shard", shard)
        assert f"next, when all shards are done: houseexpo assemble {tmp_path / 'out'}" in done
    call("assemble", tmp_path / "out")
    assert read_build_record(tmp_path / "out") == BuildRecord(BuildCommand(("procedural:2",), {"seed": "4"}))


@pytest.mark.slow
def test_what_a_later_build_made_of_a_data_set_is_not_taken_back(tmp_path: Path) -> None:
    words, out = ["build", "procedural:3", "--out", str(tmp_path / "out"), "--workers", "1"], tmp_path / "out"
    for command in ([*words, "--limit", "1", "--shard", "0/1"], ["assemble", str(out)], words):
        call(*command)
    before = contents(out)
    call("assemble", out, code=2)
    assert contents(out) == before
    for command in ([*words, "--shard", "0/1"], ["assemble", str(out)]):
        call(*command)
    assert contents(out) == before


def test_the_only_shard_of_a_build_hears_new_corrections(street: Path, tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    run_shard(config_for([street]), out, "0/1")
    begun = begin_shards(config_for([street], licence="CC0-1.0"), out, 1, {"a": Override(drop=True)})
    assert require_common_settings(out) == begun
    assert unfinished_inputs(begun, out) == {0: ["a"]}
    with pytest.raises(ConfigError, match="other sources"):
        begin_shards(config_for([street], limit=2), out, 1, {})


def test_nothing_was_begun(tmp_path: Path) -> None:
    said = call("assemble", tmp_path, code=2)
    assert "expected a build in shards, found none" in said


def test_shards_of_another_build_and_other_things_are_refused(street: Path, tmp_path: Path) -> None:
    run_shard(config_for([street]), tmp_path / "out", "0/2")
    for config, shard, said in (
        (config_for([street]), "0/3", "a build with 2 shards, not 3 was begun there"),
        (config_for([street], seed=5), "1/2", r"other parameters \(build.seed: 0, this one's is 5\) was begun"),
        (config_for([street / "a.ply"]), "1/2", "other sources"),
    ):
        with pytest.raises(ConfigError, match=said):
            run_shard(config, tmp_path / "out", shard)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(ConfigError, match="expected an empty folder or an earlier build"):
        begin_shards(config_for([street]), str(tmp_path / "mine"), 2, {})
    assert [file.name for file in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_a_place_with_plans_of_other_houses_is_refused_before_the_work(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        one_room(tmp_path / name / f"{name}.ply", 9.0)
    run_build([tmp_path / "one"], tmp_path / "out")
    before = contents(tmp_path / "out")
    said = r"holds plans of other sources \(.*one\); shards have a place of their own; choose another --out"
    with pytest.raises(ConfigError, match=said):
        run_shard(config_for([tmp_path / "other"]), tmp_path / "out", "0/1")
    assert contents(tmp_path / "out") == before
    run_shard(config_for([tmp_path / "one", tmp_path / "other"]), tmp_path / "out", "0/1")  # it lists them, too
    assert len(run_assemble(tmp_path / "out").entries) == 2


def test_assemble_waits_for_no_shard_that_is_at_work(street: Path, tmp_path: Path) -> None:
    run_shard(config_for([street]), tmp_path / "out", "0/1")
    store = open_store(str(tmp_path / "out"))
    with (
        store.hold_with_shards(),
        store.hold_with_shards(),
        pytest.raises(ConfigError, match="another build is at work"),
    ):
        run_assemble(tmp_path / "out")
    run_assemble(tmp_path / "out")


def test_every_id_belongs_to_one_shard_and_the_last_is_the_first() -> None:
    ids = [*map(str, range(1000)), "caf\udce9"]
    shares = [sum(Shard(number, 4).holds(name) for name in ids) for number in range(4)]
    assert sum(shares) == len(ids)
    assert min(shares) > 200
    assert Shard.of("4/4") == Shard.of("0/4") == Shard(0, 4)


@pytest.mark.parametrize("text", ["", "3", "5/4", "-1/4", "a/b", "0/0", "1/2/3", "1.0/4"])
def test_what_is_no_shard_is_said(text: str) -> None:
    with pytest.raises(ConfigError, match="expected NUMBER/COUNT"):
        Shard.of(text)


def test_what_was_begun_is_read_as_it_was_written(street: Path, tmp_path: Path) -> None:
    begun = begin_shards(config_for([street], scale=20.0), str(tmp_path / "out"), 2, {})
    assert read_common_settings(FolderStore(tmp_path / "out")) == begun
    assert begun.config.build.sources == (str(street),)
