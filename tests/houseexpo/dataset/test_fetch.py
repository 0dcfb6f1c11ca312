"""Downloads that break off or lie; a server on this machine plays both sides."""

from __future__ import annotations

import hashlib
import tarfile
import tomllib
from pathlib import Path

import numpy as np
import pytest

from houseexpo import ConfigError, DatasetError, open_dataset
from houseexpo.dataset.fetch import fetch, git_blob_id, subset_folder
from houseexpo.dataset.manifest import DownloadFile, DownloadManifest, load_manifest, manifest_path
from houseexpo.files import cache_folder
from pipeline.config import PipelineConfig
from pipeline.config_file import load_config
from tests.builders.plan_files import hexed, houses, tar
from tests.builders.services import serving

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data" / "houseexpo"
NOISE = np.random.default_rng(0).bytes(600_000)  # breaks shorter than a packet of 64 KB would keep nothing
ARCHIVE = tar({"noise.bin": NOISE} | {f"json/{name}.json": data for name, data in houses(120).items()})
TRAIN = f"{hexed(3)}\n{hexed(1)}\n".encode()


def blob(data: bytes) -> str:
    return hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest()  # noqa: S324 - git's own


@pytest.fixture
def server(tmp_path, monkeypatch):
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("pooch.core.time.sleep", lambda _: None)
    with serving({"json.tar.gz": ARCHIVE, "map_id_train.txt": TRAIN}) as served:
        yield served


def published(server, data: bytes = ARCHIVE) -> DownloadManifest:
    return DownloadManifest(
        name="Small",
        licence="MIT",
        source=server.address,
        paper="",
        plans=120,
        archive=DownloadFile("json.tar.gz", f"{server.address}/json.tar.gz", blob(data)),
        lists=(DownloadFile("map_id_train.txt", f"{server.address}/map_id_train.txt", blob(TRAIN)),),
        subsets={"demo": tuple(hexed(i) for i in range(100, 110))},
    )


def test_fetching_once(server):
    seen = []
    folder = fetch(manifest=published(server), progress=lambda *told: seen.append(told))
    plans = open_dataset(folder)
    assert len(plans) == 120
    assert plans.split("train").ids == [hexed(3), hexed(1)]
    assert ("json.tar.gz", len(ARCHIVE), len(ARCHIVE)) in seen
    before = len(server.requests)
    assert fetch(manifest=published(server)) == folder
    assert len(server.requests) == before


def test_what_another_process_has_fetched_meanwhile_stays(server):
    manifest = published(server)
    theirs = subset_folder("all", manifest) / "theirs.json"

    def quicker(*_told: object) -> None:
        theirs.parent.mkdir(exist_ok=True)
        theirs.write_text("{}")

    folder = fetch(manifest=manifest, progress=quicker)
    assert list(folder.iterdir()) == [theirs]
    assert list(folder.parent.iterdir()) == [folder]


def test_subsets_lie_in_each_other(server):
    ten, hundred = (set(open_dataset(fetch(n, manifest=published(server))).ids) for n in ("10", "100"))
    assert ten == {hexed(i) for i in range(100, 110)}
    assert len(hundred) == 100
    assert ten < hundred
    assert sum(name == "json.tar.gz" for name, _ in server.requests) == 1


def test_a_break_is_resumed(server):
    server.cut = 2
    assert len(open_dataset(fetch(manifest=published(server)))) == 120
    asked = [wanted for name, wanted in server.requests if name == "json.tar.gz"]
    assert asked[0] is None
    first, second = (int(wanted.removeprefix("bytes=").removesuffix("-")) for wanted in asked[1:])
    assert 0.3 < first / len(ARCHIVE) < 0.5 < second / len(ARCHIVE) < 0.75


def test_what_stays_corrupt_is_thrown_away(server):
    server.corrupt = 99
    with pytest.raises(DatasetError, match="git blob id") as caught:
        fetch(manifest=published(server))
    assert blob(ARCHIVE) in str(caught.value)
    assert not list(cache_folder("downloads").iterdir())
    assert not subset_folder("all", published(server)).exists()


def test_a_file_that_rots_in_the_cache_is_fetched_again(server):
    fetch("10", manifest=published(server))
    (cache_folder("downloads") / "json.tar.gz").write_bytes(ARCHIVE[:-1] + b"x")
    assert len(open_dataset(fetch("100", manifest=published(server)))) == 100


def test_an_archive_puts_nothing_elsewhere_and_one_that_is_cut_off_leaves_nothing(server, tmp_path):
    link = tarfile.TarInfo("json/link.json")
    link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
    names = ("../../evil.json", "json/../../evil.json", "/evil.json", f"json/{hexed(1)}.json")
    server.files["json.tar.gz"] = data = tar(dict.fromkeys(names, houses(2)[hexed(1)]), (link,))
    folder = fetch(manifest=published(server, data))
    assert sorted(file.name for file in folder.rglob("*.json")) == sorted([f"{hexed(1)}.json", "evil.json"])
    assert not [file for file in tmp_path.rglob("evil.json") if folder not in file.parents]
    server.files["json.tar.gz"] = data = ARCHIVE[: len(ARCHIVE) // 2]
    with pytest.raises(DatasetError, match="cut off"):
        fetch(manifest=published(server, data))
    assert not subset_folder("all", published(server, data)).exists()


def test_no_such_file_and_no_server(server):
    lost = DownloadFile("json.tar.gz", f"{server.address}/lost", blob(ARCHIVE))
    with pytest.raises(DatasetError, match="404"):
        fetch(manifest=DownloadManifest("Lost", "", "", "", 0, lost))
    nobody = DownloadFile("json.tar.gz", "http://127.0.0.1:9/json.tar.gz", blob(ARCHIVE))
    with pytest.raises(DatasetError, match="Check the connection"):
        fetch(manifest=DownloadManifest("Nobody", "", "", "", 0, nobody))


def test_the_manifests_that_come_with_the_project():
    manifest = load_manifest()
    assert manifest.archive.git_blob == "594e09629b7d738f4000bd7e42fffb8c5ef975f9"
    assert len(manifest.subsets["demo"]) == 10
    assert load_config(manifest_path("suncg")).stages == PipelineConfig()
    assert tomllib.loads(manifest_path("demo").read_text())["build"]["sources"] == ["procedural:300?style=sound"]
    with pytest.raises(ConfigError, match="known: benchmark, demo"):
        manifest_path("nothing")


def test_a_manifest_that_is_none(tmp_path):
    file = tmp_path / "m.toml"
    for text in ("name = 3", "[[", 'name = "x"\nunknown = 1'):
        file.write_text(text)
        with pytest.raises(ConfigError, match=r"m\.toml"):
            load_manifest(file)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_manifest(tmp_path / "missing.toml")


@pytest.mark.parametrize("bad", ["../evil", "a/b", "..", ".hidden", "", "/etc/passwd", "a\\b"])
@pytest.mark.parametrize("key", ["file", "name"])
def test_a_manifest_names_nothing_outside_its_folder(tmp_path, key, bad):
    text = manifest_path("houseexpo").read_text()
    own = 'name = "HouseExpo"' if key == "name" else 'file = "json.tar.gz"'
    assert own in text
    (tmp_path / "m.toml").write_text(text.replace(own, f"{key} = '{bad}'", 1))
    with pytest.raises(ConfigError, match=f"{key}: expected a plain name"):
        load_manifest(tmp_path / "m.toml")


def test_the_lists_are_the_published_ones():
    if not SHARED.exists():
        pytest.skip("the published plans are not on this machine")
    manifest = load_manifest()
    for source in manifest.lists:
        assert git_blob_id(SHARED / source.file) == source.git_blob
    assert manifest.subsets["demo"] == tuple((SHARED / "map_id_10.txt").read_text().split())
