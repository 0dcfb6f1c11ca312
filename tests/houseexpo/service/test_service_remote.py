"""A remote data set lists, selects and loads as a local one; what goes wrong on the way is said."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from houseexpo import open_dataset
from houseexpo.commands.arguments import plans_from_arguments
from houseexpo.dataset.validation import validate_dataset
from houseexpo.errors import DatasetError, UnknownPlanError
from houseexpo.release import release
from houseexpo.service.service import Service
from tests.builders.services import built, running, service_of, serving, some_plans, two_rooms


@pytest.fixture
def address(service: Service) -> Iterator[str]:
    with running(service) as found:
        yield found


def test_it_is_as_the_local_one(address: str, folder: Path) -> None:
    local, remote = open_dataset(folder), open_dataset(f"{address}/homes")
    assert remote.ids == local.ids
    assert [remote.raw(name) for name in remote.ids] == [local.raw(name) for name in local.ids]
    assert list(map(str, remote)) == list(map(str, local))
    assert remote.splits == local.splits
    assert remote.split("train").ids == ["a1", "c3"]
    assert remote.column("navigability") == local.column("navigability")
    assert remote.select(labels=["garage"], doors=1, area=(10, None)).ids == ["b2"]
    assert remote.sample(2, 0).ids == local.sample(2, 0).ids
    assert repr(remote) == "Dataset('homes', 4 plans)"
    with pytest.raises(UnknownPlanError, match=f"^{address}/homes: no 'nobody'"):
        remote["nobody"]


def test_commands_that_need_files_say_so(address: str, tmp_path: Path) -> None:
    for needs in (validate_dataset, lambda place: release(place, tmp_path / "out")):
        with pytest.raises(DatasetError, match=f"^{address}/homes: [a-z]+ needs the files of a data set"):
            needs(Path(f"{address}/homes?token=secret"))
    assert open_dataset(f"HTTP{address.removeprefix('http')}/homes").ids[0] == "a1"


def test_what_was_fetched_is_kept(address: str, service: Service) -> None:
    assert open_dataset(f"{address}/homes")["a1"].room_num == 2
    remote = open_dataset(f"{address}/homes")
    service.collections["homes"].path.joinpath("json", "a1.json").unlink()
    assert remote["a1"].room_num == 2
    with pytest.raises(DatasetError, match="no answer"):
        open_dataset("http://127.0.0.1:9/homes")


def test_a_kept_plan_that_was_damaged_is_fetched_anew(address: str, tmp_path: Path) -> None:
    remote = open_dataset(f"{address}/homes")
    data = remote.raw("a1")
    kept = [file for file in (tmp_path / "cache" / "remote" / "plans").rglob("*") if file.is_file()]
    kept[0].write_bytes(b"{}")
    assert remote.raw("a1") == data


def test_a_plan_that_changed_meanwhile_is_refused(address: str, folder: Path) -> None:
    remote = open_dataset(f"{address}/homes")
    built(folder, [two_rooms("a1", 6.0), *some_plans()[1:]])
    with pytest.raises(DatasetError, match="a1: was changed on the server; open the data set again"):
        remote["a1"]


def test_a_token_is_sent(folder: Path) -> None:
    word = "secret"
    with running(service_of(folder, token=word)) as address:
        assert len(open_dataset(f"{address}/homes?token={word}")) == 4
        with pytest.raises(DatasetError, match="requires a token"):
            open_dataset(f"{address}/homes")


@pytest.mark.parametrize("address", ["http://", "http://host:port/a", "http://localhost:1", "http://localhost:1/a/b"])
def test_an_address_without_a_data_set_is_refused(address: str) -> None:
    with pytest.raises(DatasetError, match="expected an address"):
        open_dataset(address)


def test_another_kind_of_server_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    with serving({"api/demo/index.parquet": b"<html>hello"}) as served:
        with pytest.raises(DatasetError, match="expected the index of a data set"):
            open_dataset(f"{served.address}/demo")
        with pytest.raises(DatasetError, match="status 404"):
            open_dataset(f"{served.address}/other")


def test_a_filter_behind_the_address_is_not_passed_over(address: str) -> None:
    with pytest.raises(DatasetError, match=r"found a filter behind it \(rooms\)"):
        open_dataset(f"{address}/homes/?rooms=8")


def test_an_address_may_come_as_a_path_and_in_commands(address: str) -> None:
    place = Path(f"{address}/homes")
    assert "://" not in str(place)
    assert open_dataset(place).ids == open_dataset(f"{address}/homes").ids
    assert len(plans_from_arguments([f"{address}/homes"], None, None)) == 4


def test_ids_that_are_not_distinct_are_refused(address: str, folder: Path) -> None:
    open_dataset(f"{address}/homes")
    (index,) = (file for file in _cache().rglob("index.parquet"))
    table = pq.read_table(index)
    stream = io.BytesIO()
    pq.write_table(pa.concat_tables([table, table[:1]]), stream)
    twice = serving({"api/homes/index.parquet": stream.getvalue()})
    with twice as server, pytest.raises(DatasetError, match="expected ids that differ, found 'a1' more than once"):
        open_dataset(f"{server.address}/homes")


def _cache() -> Path:
    return Path(os.environ["HOUSEEXPO_CACHE"])
