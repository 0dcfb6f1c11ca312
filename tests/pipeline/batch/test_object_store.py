"""Sources and data sets in an object store: a real S3 interface, on this machine."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from pipeline.batch.data_set_folder import ExistingPlansPolicy
from pipeline.batch.mirror import mirror_source
from pipeline.batch.shard_build import require_common_settings, unfinished_inputs
from tests.builders.batch import config_for, contents, one_room, run_assemble, run_build, run_shard, sketched
from tests.builders.clusters import BUCKET, forget, puts, s3_server
from tests.builders.commands import call
from tests.builders.needs import need

pytestmark = pytest.mark.slow
SOURCE, OUT = f"s3://{BUCKET}/in/street", f"s3://{BUCKET}/out/plans"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A running server; its log lies in this folder."""
    need(modules=["flask", "moto", "s3fs"], how="make cluster")
    folder = tmp_path_factory.mktemp("server")
    with s3_server(folder):
        yield folder


@pytest.fixture
def bucket(log: Path, street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The file system of a bucket that holds the houses; what is fetched lies in ``tmp_path``."""
    import s3fs

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("pipeline.batch.mirror._mounted", {})
    system = s3fs.S3FileSystem(use_listings_cache=False)
    system.rm(BUCKET, recursive=True)
    system.mkdir(BUCKET)
    system.put(str(street), f"{BUCKET}/in/street", recursive=True)
    return system


def stored(system: Any, place: str) -> dict[str, bytes]:
    """Every object outside .build, by its name in the data set."""
    path = place.removeprefix("s3://")
    found = {str(name).removeprefix(f"{path}/"): name for name in system.find(path)}
    return {name: system.cat_file(full) for name, full in found.items() if not name.startswith(".build/")}


def test_shards_in_an_object_store_give_the_bytes_of_a_serial_build(
    bucket: Any, serial: dict[str, bytes], log: Path
) -> None:
    config, before = config_for([SOURCE]), Counter(puts(log))
    run_shard(config, OUT, "1/2")
    assert set(unfinished_inputs(require_common_settings(OUT), OUT)) == {0}
    run_shard(config, OUT, "0/2")
    run_assemble(OUT)
    assert stored(bucket, OUT) == serial
    written = Counter(puts(log)) - before
    results = [name for name in written if "/.build/plans/" in name]
    assert len(results) == 6  # one that is refused has none, one that is a copy has
    assert set(written.values()) == {1}

    run_shard(config, OUT, "0/2")
    run_assemble(OUT)
    assert Counter(puts(log)) - before == written  # what is done is not done again

    bucket.pipe_file(f"{BUCKET}/out/plans/json/mine.json", b"{}")
    with pytest.raises(ConfigError, match="1 objects that no build wrote"):
        run_assemble(OUT)


def test_the_command_builds_into_an_object_store(bucket: Any, serial: dict[str, bytes]) -> None:
    for _ in ("first", "again"):
        found = CliRunner().invoke(make_app(), ["build", SOURCE, "--out", OUT])
        assert (found.exit_code, found.exception) == (0, None)
        assert f"data set  {OUT}" in found.stdout
        assert {name for name in stored(bucket, OUT) if name.startswith("json/")} <= set(serial)


def test_a_copy_in_a_folder_is_a_data_set_like_any_other(bucket: Any, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    run_shard(config_for([SOURCE]), OUT, "0/1")
    run_assemble(OUT)
    bucket.get(f"{OUT}/", f"{copy}/", recursive=True)
    before = contents(copy)
    villa = one_room(tmp_path / "villa.ply", 12.0, 7.0)
    with pytest.raises(ConfigError, match="--add keeps them"):
        run_build([villa], copy)
    with pytest.raises(ConfigError, match="other parameters"):
        run_build([SOURCE], copy, seed=5)
    assert contents(copy) == before
    run_build([SOURCE], copy)
    assert contents(copy) == before
    run_build([villa], copy, others=ExistingPlansPolicy.ADD)
    assert {*before} < {*contents(copy)}


def test_what_cannot_be_reached_is_not_taken_for_nothing(
    bucket: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_shard(config_for([SOURCE]), OUT, "0/1")
    with pytest.raises(ConfigError, match="s3://none/plans: expected a bucket that is there"):
        run_shard(config_for([SOURCE]), "s3://none/plans", "0/1")
    with pytest.raises(ConfigError, match="'s3://none/in' does not exist"):
        run_shard(config_for(["s3://none/in"]), OUT, "0/1")
    found = call("build", "--verify", OUT, code=2)
    assert "expected a folder" in found
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    forget()
    try:
        (tmp_path / "houses.toml").write_text('[build]\nsources = ["procedural:1"]\n')
        for words in (["assemble", OUT], ["slurm", str(tmp_path / "houses.toml"), "--shards", "2", "--out", OUT]):
            found = call(*words, code=3)
            assert "could not connect" in found.lower()
    finally:
        forget()


def test_pictures_of_the_stages_go_with_the_plans(bucket: Any, street: Path, tmp_path: Path) -> None:
    run_build([street], tmp_path / "plans", plan=sketched, keep_stages=True)
    config = config_for([SOURCE], keep_stages=True)
    run_shard(config, OUT, "0/1", plan=sketched)
    run_assemble(OUT)
    found = stored(bucket, OUT)
    assert {name for name in found if name.startswith("stages/")} == {
        name.replace("json", "stages", 1).replace(".json", ".png") for name in found if name.startswith("json/")
    }
    assert found == contents(tmp_path / "plans")
    lost = next(name for name in found if name.startswith("stages/"))
    bucket.rm(f"{BUCKET}/out/plans/{lost}")
    run_assemble(OUT)
    assert stored(bucket, OUT) == found


def test_a_source_is_fetched_as_far_as_it_is_read_and_another_place_is_none_of_it(bucket: Any, tmp_path: Path) -> None:
    bucket.pipe_file(f"{BUCKET}/in/street/../../out.ply", b"ply")
    bucket.pipe_file(f"{BUCKET}/in/street/large.ply", b"ply\n" + bytes(1 << 20))
    mirror, place = mirror_source(SOURCE)
    found = {file.relative_to(place).as_posix() for file in place.rglob("*") if file.is_file()}
    assert found == {"a.ply", "b.ply", "c.ply", "far/e.obj", "g_refuse.glb", "large.ply", *_split(found), "z.ply"}
    large = place / "large.ply"
    assert large.stat().st_blocks * 512 < large.stat().st_size
    assert large.read_bytes()[:4] == b"ply\n"
    assert large.stat().st_blocks * 512 < large.stat().st_size  # a listing needs its beginning only
    mirror.mount()
    assert large.read_bytes() == b"ply\n" + bytes(1 << 20)
    assert not (tmp_path / "out.ply").exists()


def _split(found: set[str]) -> set[str]:
    return {name for name in found if name.startswith("split/")}


def test_a_source_that_is_not_there_and_a_place_that_holds_other_things(bucket: Any) -> None:
    with pytest.raises(ConfigError, match="does not exist, or holds nothing"):
        run_shard(config_for([f"s3://{BUCKET}/nowhere"]), OUT, "0/1")
    with pytest.raises(ConfigError, match="expected s3://"):
        run_shard(config_for(["what://houses"]), OUT, "0/1")
    with pytest.raises(ConfigError, match="found other objects"):
        run_shard(config_for([SOURCE]), f"s3://{BUCKET}/in", "0/1")


def test_one_file_of_an_object_store_comes_with_what_lies_beside_it(bucket: Any, street: Path, tmp_path: Path) -> None:
    run_shard(config_for([f"{SOURCE}/split/f.gltf"]), tmp_path / "one", "0/1")
    run_assemble(tmp_path / "one")
    run_build([street / "split" / "f.gltf"], tmp_path / "two")
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert "json/split_f.json" in contents(tmp_path / "one")
