"""Broken data sets: the error names what is wrong and where, and nothing half is kept."""

from __future__ import annotations

import gzip
import io
import re
import tarfile
from pathlib import Path

import pytest

from houseexpo import Dataset, DatasetError, HouseExpoError, encode, open_dataset
from houseexpo.dataset.index import index_row, index_table
from houseexpo.dataset.store import stored_plans
from houseexpo.dataset.store.cache import VERSION
from houseexpo.dataset.store.catalogue import parse_id_list
from houseexpo.dataset.validation import validate_dataset
from houseexpo.files import cache_folder
from houseexpo.pseudoslam.benchmark.cases import choose_plan_ids
from tests.builders.plan_files import KINDS, hexed, house, houses, pack, tar


@pytest.fixture(autouse=True)
def _nothing_is_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    yield
    assert len(list(cache_folder("stores", VERSION).iterdir())) == len(opened)
    opened.clear()
    assert not [name for name in tmp_path.rglob("*") if name.name in ("evil", "evil.json")]


opened: list[Dataset] = []
"""The data sets that a test could open; of others, no copy is kept."""


def refused(path: Path) -> str:
    with pytest.raises(HouseExpoError) as caught:
        open_dataset(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def good(name: str = "good") -> bytes:
    return encode(house(name))


BAD = {
    "nan": (good("a").replace(b"4.1", b"NaN"), "plan 'a'"),
    "infinite": (good("a").replace(b"4.1", b"1e999"), "plan 'a'.*verts"),
    "strings": (good("a").replace(b"[0.1,4.1]", b'["0.1","4.1"]'), r"plan 'a'.*verts\[1\]"),
    "missing key": (good("a").replace(b'"room_num":1,', b""), "plan 'a'.*room_num.*not a whole plan"),
    "nested": (good("a").replace(b'"room_num"', b'"more":' + b"[" * 10_000 + b"]" * 10_000 + b',"room_num"'), "nested"),
    "nested verts": (b'{"id":"a","verts":' + b"[" * 10_000 + b"]" * 10_000 + b"}", "plan 'a'"),
    "encoding": (good("a").decode().encode("utf-16"), "UTF-8"),
    "latin": (good("a").replace(b"Kitchen", b"K\xfcche"), "plan 'a'"),
    "cut off": (good("a")[:-20], "plan 'a'"),
    "outside": (good("a").replace(b'"id":"a"', b'"id":"../evil"'), "id: expected a name that is safe"),
    "wrong bounds": (good("a").replace(b'"max":[4.1,4.1]', b'"max":[9,9]'), "plan 'a'.*bbox"),
    "no object": (b"[]", "expected"),
    "lines only": (
        good("a").replace(b"[4.1,4.1],[4.1,0.1]", b"[0.1,2.1]").replace(b'"max":[4.1,4.1]', b'"max":[0.1,4.1]'),
        "plan 'a'.*verts: expected a ring that encloses an area",
    ),
}


@pytest.mark.parametrize("fault", BAD)
@pytest.mark.parametrize("kind", ["folder", "tar.gz", "jsonl"])
def test_a_bad_plan_is_named_and_costs_no_other(tmp_path, kind, fault, caplog):
    data, says = BAD[fault]
    if kind == "jsonl" and fault == "encoding":
        data = data.replace(b"\n", b"")
    path = pack(tmp_path, kind, {"good": good(), "bad": data, "last": good("last")})
    place = "line 2" if kind == "jsonl" else "bad.json"
    for _ in range(2):  # from the cached copy, too
        caplog.clear()
        plans = open_dataset(path)
        assert plans.ids == [plan.id for plan in plans] == ["good", "last"]
        (left_out,) = plans.left_out
        assert left_out.place.endswith(place)
        (message,) = caplog.messages
        assert message.startswith(f"{path}: 1 plan left out, cannot be read: {left_out}")
    opened.append(plans)
    assert left_out.place in [found.place for found in validate_dataset(path).findings]
    with pytest.raises(DatasetError, match=f"expected a whole data set.*{place}"):
        choose_plan_ids(plans, "test", 1)
    alone = tmp_path / "alone"
    alone.mkdir()
    message = refused(pack(alone, kind, {"bad": data}))
    assert ("line 1" if kind == "jsonl" else "bad.json") in message
    assert re.search(says, message), message


@pytest.mark.parametrize("kind", ["tar.gz", "jsonl.gz"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.999])
def test_truncated(tmp_path, kind, share):
    path = pack(tmp_path, kind, houses(50))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    assert "cut off" in refused(path)


@pytest.mark.parametrize("kind", ["tar.gz", "jsonl.gz", "zip"])
def test_one_byte_is_wrong(tmp_path, kind):
    path = pack(tmp_path, kind, houses(50))
    data = bytearray(path.read_bytes())
    data[len(data) // 2 if kind != "zip" else 100] ^= 0x10
    path.write_bytes(bytes(data))
    refused(path)


@pytest.mark.parametrize("kind", [k for k in KINDS if k not in ("folder", "nested")])
def test_garbage_and_nothing(tmp_path, kind):
    path = tmp_path / f"plans.{kind}"
    path.write_bytes(b"\x93garbage" * 100)
    refused(path)
    path.write_bytes(b"")
    refused(path)


def test_no_data_set(tmp_path):
    (tmp_path / "folder").mkdir()
    assert "found none" in refused(tmp_path / "folder")
    assert "found nothing there" in refused(tmp_path / "missing")
    (tmp_path / "plan.png").write_bytes(b"")
    assert "found .png" in refused(tmp_path / "plan.png")
    (tmp_path / "house.obj").write_bytes(b"")
    assert "found .obj; if it is a model of a house, a drawn plan or a robot's map, `houseexpo build` makes" in refused(
        tmp_path / "house.obj"
    )
    (tmp_path / "plan.json").write_text("{}")
    assert "found .json; if it is a plan, houseexpo.load_plan(path) opens it" in refused(tmp_path / "plan.json")


@pytest.mark.parametrize("kind", ["folder", "tar.gz", "jsonl"])
def test_two_plans_with_one_id(tmp_path, kind):
    path = pack(tmp_path, kind, {"one": good("a"), "two": good("a")})
    assert "found 'a' in" in refused(path)


def test_a_member_of_a_gigabyte(tmp_path):
    path = tmp_path / "plans.tar.gz"
    header = tarfile.TarInfo("json/big.json")
    header.size = 2**30
    path.write_bytes(gzip.compress(header.tobuf() + bytes(2**16)))
    assert "json/big.json: expected a plan of at most 64 MiB, found 1024 MiB" in refused(path)


@pytest.mark.parametrize("kind", ["zip", "jsonl.gz", "folder"])
def test_a_plan_that_is_too_large(tmp_path, kind, monkeypatch):
    monkeypatch.setattr(stored_plans, "MAX_PLAN_BYTES", 10_000)
    path = pack(tmp_path, kind, {"good": good(), "large": b" " * 20_000 + good("large")})
    assert "expected a plan of at most" in refused(path)


def test_an_archive_that_unpacks_to_too_much(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_plans, "MAX_BYTES", 20_000)
    path = tmp_path / "plans.tar.gz"
    path.write_bytes(tar({"json/a.json": good("a"), "pictures/a.png": bytes(100_000)}))
    assert "found more" in refused(path)


def test_members_outside_are_only_read(tmp_path):
    path = tmp_path / "plans.tar.gz"
    link = tarfile.TarInfo("json/link.json")
    link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
    path.write_bytes(tar({"../evil.json": good().replace(b"good", b"../evil")}, (link,)))
    assert "safe as a file name" in refused(path)


def test_a_list_that_is_none():
    for data in (b"good\n../../evil\n", b"\xff\xfe", b"a\na\n"):
        with pytest.raises(HouseExpoError, match="list"):
            parse_id_list(data, "list 'train'")


def test_a_build_that_is_not_finished(tmp_path):
    path = pack(tmp_path, "nested", {hexed(1): good(hexed(1))})
    (path / ".build").mkdir()
    assert "finished build" in refused(path)


def test_an_index_of_other_plans(tmp_path):
    path = pack(tmp_path, "nested", {"a": good("a")})
    (path / "index.parquet").write_bytes(index_table([index_row(house("a")), index_row(house("b"))]))
    assert "b.json" in refused(path)
    (path / "index.parquet").write_bytes(b"PAR1")
    assert "index.parquet" in refused(path)
    (path / "index.parquet").write_bytes(index_table([index_row(house("a"))]))
    assert open_dataset(path).ids == ["a"]


def test_a_zip_that_lies_about_a_size(tmp_path, monkeypatch):
    path = pack(tmp_path, "zip", {"large": b" " * 20_000 + good("large")})
    data = path.read_bytes()
    real = (20_000 + len(good("large"))).to_bytes(4, "little")
    path.write_bytes(data.replace(real, (100).to_bytes(4, "little")))
    refused(path)


@pytest.mark.parametrize(("place", "value"), [(6, 1), (8, 99)])
def test_a_zip_that_is_locked_or_packed_in_an_unknown_way(tmp_path, place, value):
    path = pack(tmp_path, "zip", {"a": good("a")})
    data = bytearray(path.read_bytes())
    for mark, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):  # in the member's header, and in the directory
        data[data.index(mark) + place + shift] = value
    path.write_bytes(data)
    assert "expected a whole file" in refused(path)


def test_a_tar_with_one_member_twice(tmp_path):
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for _ in range(2):
            info = tarfile.TarInfo("json/a.json")
            info.size = len(good("a"))
            archive.addfile(info, io.BytesIO(good("a")))
    path = tmp_path / "plans.tar.gz"
    path.write_bytes(stream.getvalue())
    assert "expected ids that differ, found 'a' in json/a.json and in json/a.json" in refused(path)
