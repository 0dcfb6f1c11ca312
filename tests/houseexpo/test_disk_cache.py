"""The one cache on disk: what it finds again, and what happens to it when something goes wrong."""

from __future__ import annotations

import multiprocessing
import os
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from houseexpo import disk_cache
from houseexpo.disk_cache import DiskCache
from tests.builders.tries import tries


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "things-1.sqlite"


def written(file: Path, **values: bytes) -> DiskCache:
    cache = DiskCache(file)
    for key, value in values.items():
        cache.put("a", key.encode(), value)
    cache.flush()
    return cache


@tries(100)
@given(st.dictionaries(st.tuples(st.sampled_from("ab"), st.binary()), st.binary()))
def test_it_is_a_dictionary_that_others_find(tmp_path_factory: pytest.TempPathFactory, entries) -> None:
    file = tmp_path_factory.mktemp("cache") / "things.sqlite"
    one, other = DiskCache(file), DiskCache(file)
    for (name, key), value in entries.items():
        one.put(name, key, value)
    for cache in (one, other):
        one.flush()
        for name in "ab":
            expected = {key: value for (of, key), value in entries.items() if of == name}
            assert cache.items(name) == expected
            assert cache.keys(name) == set(expected)
            assert all(cache.get(name, key) == value for key, value in expected.items())
        assert cache.get("c", b"") is None


def test_the_end_of_a_program_writes_what_waits(file: Path) -> None:
    code = f"from houseexpo.disk_cache import DiskCache; from pathlib import Path; c = DiskCache(Path({str(file)!r})); "
    subprocess.run([sys.executable, "-c", code + "c.put('a', b'k', b'v')"], check=True)
    assert DiskCache(file).get("a", b"k") == b"v"


@pytest.mark.parametrize("place", [0, 30, 4096, 5000])
def test_a_damaged_file_is_made_anew(file: Path, place: int) -> None:
    written(file, **{f"key{n}": bytes([n]) * 2000 for n in range(9)})
    with file.open("r+b") as stream:
        stream.seek(place)
        stream.write(b"\xff" * 3000)
    cache = DiskCache(file)
    for n in range(9):
        assert cache.get("a", f"key{n}".encode()) in {None, bytes([n]) * 2000}
    cache.put("a", b"new", b"value")
    cache.flush()
    assert DiskCache(file).get("a", b"new") == b"value"


@pytest.mark.parametrize("content", [b"", b"no database", bytes(5000)])
def test_a_file_that_is_no_cache_is_replaced(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    written(file, key=b"value")
    assert DiskCache(file).items("a") == {b"key": b"value"}


@pytest.mark.parametrize("kind", ["BLOB", "TEXT"])
def test_a_value_with_a_wrong_bit_is_absent(file: Path, kind: str) -> None:
    written(file, key=b"value", other=b"value")
    with closing(sqlite3.connect(file)) as database, database:
        wrong = "walue" if kind == "TEXT" else b"walue"
        database.execute("UPDATE entries SET value = ? WHERE key = x'6b6579'", (wrong,))
    cache = DiskCache(file)
    assert cache.get("a", b"key") is None
    assert cache.items("a") == {b"other": b"value"}


def test_where_nothing_can_be_written_entries_stay_in_memory(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    cache = DiskCache(tmp_path / "no folder" / "things.sqlite")
    for _ in range(2):
        cache.put("a", b"key", b"value")
        cache.flush()
    assert cache.get("a", b"key") == b"value"
    assert cache.keys("a") == {b"key"}
    assert len(caplog.records) == 1
    with pytest.raises(sqlite3.Error, match="unable to open"):
        DiskCache(tmp_path / "no folder" / "things.sqlite").write("a", {b"key": b"value"})


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_read(file: Path) -> None:
    written(file, key=b"value")
    file.chmod(0o400)
    file.parent.chmod(0o500)
    try:
        assert DiskCache(file).get("a", b"key") == b"value"
    finally:
        file.parent.chmod(0o700)


def test_the_oldest_half_goes_when_the_file_is_too_large(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "_FILE_BYTES", 100_000)
    cache = DiskCache(file)
    for n in range(100):
        cache.write("a", {n.to_bytes(): bytes(5000)})
        assert n.to_bytes() in cache.keys("a")
    assert 5 < len(cache.keys("a")) <= 20
    assert file.stat().st_size < 200_000


def write_many(file: Path, first: int) -> None:
    cache = DiskCache(file)
    for n in range(first, first + 50):
        cache.put("a", n.to_bytes(2), n.to_bytes(2) * 500)
        cache.flush()


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_processes_write_at_once(file: Path, method: str) -> None:
    written(file, key=b"value").get("a", b"key")
    context = multiprocessing.get_context(method)
    processes = [context.Process(target=write_many, args=(file, 50 * k)) for k in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert DiskCache(file).items("a") == {n.to_bytes(2): n.to_bytes(2) * 500 for n in range(200)} | {b"key": b"value"}


def test_threads_share_a_cache(file: Path) -> None:
    cache = DiskCache(file)

    def write(first: int) -> None:
        for n in range(first, first + 20):
            cache.put("a", n.to_bytes(), n.to_bytes())
            assert cache.get("a", n.to_bytes()) == n.to_bytes()

    threads = [threading.Thread(target=write, args=(20 * k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    cache.flush()
    assert len(DiskCache(file).items("a")) == 80


@pytest.mark.slow
def test_a_process_killed_while_it_writes_leaves_what_it_wrote_before(file: Path) -> None:
    context = multiprocessing.get_context("spawn")
    for _ in range(3):
        process = context.Process(target=write_many, args=(file, 0))
        process.start()
        limit = time.monotonic() + 30
        while not file.exists() and time.monotonic() < limit:
            time.sleep(0.01)
        time.sleep(0.05)
        process.kill()
        process.join()
        found = DiskCache(file).items("a")
        assert all(value == key * 500 for key, value in found.items())
