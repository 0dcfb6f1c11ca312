"""Broken data sets: the error names what is wrong and where, and nothing half is kept."""

from __future__ import annotations

import gzip
import re
import tarfile
from pathlib import Path

import numpy as np
import pytest

from houseexpo import ConfigError, Dataset, DatasetError, HouseExpoError, build, encode, export, open_dataset
from houseexpo.dataset.index import index_row, index_table
from houseexpo.dataset.store import stored_plans
from houseexpo.dataset.store.cache import VERSION
from houseexpo.dataset.store.catalogue import parse_id_list
from houseexpo.dataset.validation import validate_dataset
from houseexpo.files import cache_folder
from houseexpo.pseudoslam.benchmark.cases import choose_plan_ids
from houseexpo.release import release
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


def noisy_houses(count: int) -> dict[str, bytes]:
    """Return plans that hardly compress, so that a cut of an archive is a cut in its plans."""
    draw = np.random.default_rng(0)
    return {
        name: data[:-1] + b',"note":"' + draw.bytes(1000).hex().encode() + b'"}' for name, data in houses(count).items()
    }


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
        assert message.startswith(f"{path}: plans left out, cannot be read, at 1 place: {left_out}")
    opened.append(plans)
    assert left_out.place in [found.place for found in validate_dataset(path).findings]
    with pytest.raises(DatasetError, match=f"expected a whole data set.*{place}"):
        choose_plan_ids(plans, "test", 1)
    alone = tmp_path / "alone"
    alone.mkdir()
    message = refused(pack(alone, kind, {"bad": data}))
    assert ("line 1" if kind == "jsonl" else "bad.json") in message
    assert re.search(says, message), message


def left_out_of(path: Path) -> tuple[list[str], list[str]]:
    """Return the ids of a data set and what was left out of it, which a second opening and ``validate`` say, too."""
    plans = open_dataset(path)
    opened.append(plans)
    assert open_dataset(path).left_out == plans.left_out
    assert {found.place for found in plans.left_out} <= {found.place for found in validate_dataset(path).findings}
    return plans.ids, [str(found) for found in plans.left_out]


@pytest.mark.parametrize("kind", ["tar.gz", "jsonl.gz"])
@pytest.mark.parametrize("share", [0.5, 0.9, 0.999])
def test_what_follows_a_cut_is_left_out(tmp_path, kind, share):
    members = noisy_houses(50)
    path = pack(tmp_path, kind, members)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    ids, (left_out,) = left_out_of(path)
    assert ids == list(members)[: len(ids)]
    assert (share - 0.15) * 50 < len(ids) <= 50
    assert "cut off" in left_out
    assert left_out.startswith("after ")


@pytest.mark.parametrize("kind", ["tar.gz", "jsonl.gz"])
def test_one_byte_is_wrong(tmp_path, kind):
    """A check sum says that some plan of an archive is another one, and not which."""
    path = pack(tmp_path, kind, houses(50))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x10
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
def test_of_plans_with_one_id_the_first_is_kept(tmp_path, kind):
    others = {"other": good("other"), "two": good("a").replace(b"4.1", b"5.1"), "zero": good("a")}
    path = pack(tmp_path, kind, {"one": good("a"), **others})
    ids, left_out = left_out_of(path)
    assert sorted(ids) == ["a", "other"]
    assert opened[-1]["a"].bbox[2] == 4.1
    assert len(left_out) == 2
    assert all("expected an id of its own, found 'a' in" in found for found in left_out)


@pytest.mark.parametrize(
    ("link", "problem"), [("a.json", "Too many levels of symbolic links"), ("nowhere", "No such file or directory")]
)
def test_a_file_of_a_folder_that_cannot_be_read(tmp_path, link, problem):
    path = pack(tmp_path, "folder", {"b": good("b")})
    (path / "a.json").symlink_to(link)
    ids, left_out = left_out_of(path)
    assert ids == ["b"]
    assert left_out == [f"a.json: cannot be read ({problem})"]


def test_a_member_of_a_gigabyte(tmp_path):
    path = tmp_path / "plans.tar.gz"
    header = tarfile.TarInfo("json/big.json")
    header.size = 2**30
    path.write_bytes(gzip.compress(header.tobuf() + bytes(2**16)))
    assert "json/big.json: expected a plan of at most 64 MiB, found 1024 MiB" in refused(path)


@pytest.mark.parametrize("kind", ["zip", "jsonl.gz", "folder"])
def test_a_plan_that_is_too_large(tmp_path, kind, monkeypatch):
    monkeypatch.setattr(stored_plans, "MAX_PLAN_BYTES", 10_000)
    path = pack(tmp_path, kind, {"good": good(), "large": b" " * 20_000 + good("large"), "next": good("next")})
    ids, (left_out,) = left_out_of(path)
    assert ids == ["good", "next"]
    assert "expected a plan of at most" in left_out


def test_a_line_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_plans, "MAX_PLAN_BYTES", 10_000)
    monkeypatch.setattr(stored_plans, "MAX_BYTES", 2**22)
    path = pack(tmp_path, "jsonl.gz", {"good": good(), "large": b" " * 2**23})
    assert "line 2: expected at most" in refused(path)


def test_an_archive_that_unpacks_to_too_much(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_plans, "MAX_BYTES", 20_000)
    path = tmp_path / "plans.tar.gz"
    path.write_bytes(tar({"json/a.json": good("a"), "pictures/a.png": bytes(100_000)}))
    assert "found more" in refused(path)


def test_an_empty_text_is_no_path(tmp_path, monkeypatch):
    monkeypatch.chdir(pack(tmp_path, "folder", {"a": good("a")}))
    calls = (
        lambda: open_dataset(""),
        lambda: open_dataset(b""),
        lambda: validate_dataset(""),
        lambda: build("procedural:1", ""),
        lambda: build("", tmp_path / "out"),
        lambda: export(house("a"), "ros", ""),
        lambda: release("", tmp_path / "out"),
    )
    for call in calls:
        with pytest.raises(ConfigError, match="expected a path, found an empty text"):
            call()
    assert [file.name for file in Path().iterdir()] == ["a.json"]


def test_a_list_that_is_none():
    for data in (b"good\n../../evil\n", b"\xff\xfe", b"a\na\n"):
        with pytest.raises(HouseExpoError, match="list"):
            parse_id_list(data, "list 'train'")


def test_a_build_that_is_not_finished(tmp_path):
    path = pack(tmp_path, "nested", {hexed(1): good(hexed(1))})
    (path / ".build").mkdir()
    assert "finished build" in refused(path)
    with pytest.raises(HouseExpoError, match="finished build"):
        validate_dataset(path)


def test_an_index_of_other_plans(tmp_path):
    path = pack(tmp_path, "nested", {"a": good("a")})
    (path / "index.parquet").write_bytes(index_table([index_row(house("b"))]))
    assert "a.json, b.json" in refused(path)
    (path / "index.parquet").write_bytes(index_table([]))
    assert "a.json" in refused(path)
    (path / "index.parquet").write_bytes(b"PAR1")
    assert "index.parquet" in refused(path)
    (path / "index.parquet").write_bytes(index_table([index_row(house("a"))]))
    assert open_dataset(path).ids == ["a"]


def test_an_index_that_lists_a_plan_twice_is_a_violation_that_names_it(tmp_path):
    path = pack(tmp_path, "nested", {name: good(name) for name in "ab"})
    (path / "index.parquet").write_bytes(index_table([index_row(house(name)) for name in "aab"]))
    (found,) = [f for f in validate_dataset(path).findings if f.rule == "index"]
    assert (found.place, found.detail) == ("a.json", "index.parquet lists it more than once; build again")
    assert "found 3 rows that differ in 1: a.json" in refused(path)


def test_of_an_index_with_other_plans_the_common_ones_are_kept(tmp_path):
    path = pack(tmp_path, "nested", {name: good(name) for name in "abd"})
    (path / "index.parquet").write_bytes(index_table([index_row(house(name)) for name in "abc"]))
    plans = open_dataset(path)
    assert plans.ids == [plan.id for plan in plans] == ["a", "b"]
    assert [str(found) for found in plans.left_out] == [
        "c.json: index.parquet lists it, and it is not there",
        "d.json: index.parquet does not list it; build again",
    ]
    assert [f.place for f in validate_dataset(path).findings if f.rule == "index"] == ["c.json", "d.json"]
    with pytest.raises(DatasetError, match="expected a whole data set"):
        choose_plan_ids(plans, "test", 1)


@pytest.mark.parametrize(("place", "value"), [(6, 1), (8, 99)])
def test_a_zip_that_is_locked_or_packed_in_an_unknown_way(tmp_path, place, value):
    path = pack(tmp_path, "zip", {"a": good("a")})
    data = bytearray(path.read_bytes())
    for mark, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):  # in the member's header, and in the directory
        data[data.index(mark) + place + shift] = value
    path.write_bytes(data)
    assert "json/a.json: cannot be unpacked" in refused(path)
