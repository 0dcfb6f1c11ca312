"""Decisions lie in a data set, or beside it; they go wherever it goes, and nothing in it leads out of it."""

from __future__ import annotations

import os
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
from starlette.testclient import TestClient
from typer.testing import CliRunner

from houseexpo.commands.app import make_app as make_commands
from houseexpo.dataset import open_dataset
from houseexpo.dataset.build_record import FILE, BuildCommand, BuildRecord, encode_build_record, write_build_record
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.review.decisions import DecisionStore
from houseexpo.service.service import Service, ServiceSettings
from tests.builders.services import built, judged_later, some_plans

QUALITIES: dict[str, float | None] = {"doubtful": 0.4, "sure": 0.95}


def flat(folder: Path) -> Path:
    return judged_later(folder / "häuser & co", QUALITIES)


def of_a_build(folder: Path) -> Path:
    found = folder / "plans"
    judged_later(found / "json", QUALITIES)
    return found


def archive(folder: Path) -> Path:
    found = folder / "plans.tar.gz"
    with tarfile.open(found, "w:gz") as tar:
        tar.add(judged_later(folder / "packed", QUALITIES), "json")
    return found


def lines(folder: Path) -> Path:
    files = sorted(judged_later(folder / "packed", QUALITIES).iterdir())
    found = folder / "plans.jsonl"
    found.write_bytes(b"".join(file.read_bytes() for file in files))
    return found


def release(folder: Path) -> Path:
    found = folder / "release"
    found.mkdir()
    (archive(folder)).rename(found / "json.tar.gz")
    (found / "croissant.json").write_text("{}")
    return found


PLACES: list[tuple[Callable[[Path], Path], str]] = [
    (flat, "häuser & co/overrides.toml"),
    (of_a_build, "plans/overrides.toml"),
    (archive, "plans.tar.gz.overrides.toml"),
    (lines, "plans.jsonl.overrides.toml"),
    (release, "release.overrides.toml"),
]


def served(path: Path, **settings: Any) -> TestClient:
    service = Service({"houses": Collection("houses", path)}, ServiceSettings(**{"review": True, **settings}))
    return TestClient(make_app(service), base_url="http://127.0.0.1")


def keep(client: TestClient, plan: str = "doubtful", status: int = 200) -> dict[str, Any]:
    asked = {"plan": plan, "action": "keep", "reviewer": "ann"}
    answer = client.post("/houses/review/decide", json=asked)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


@pytest.mark.parametrize(("make", "place"), PLACES, ids=lambda value: getattr(value, "__name__", ""))
def test_a_data_set_of_any_kind_opens_after_an_answer_and_the_page_says_where_that_is(
    make: Callable[[Path], Path], place: str, tmp_path: Path
) -> None:
    path = make(tmp_path)
    with served(path) as client:
        keep(client)
        shown = str(tmp_path / place).replace("&", "&amp;")
        assert shown in client.get("/houses/review").text
    assert "keep = true" in (tmp_path / place).read_text()
    assert (tmp_path / place).with_suffix(".log.jsonl").exists()
    assert sorted(open_dataset(path).ids) == ["doubtful", "sure"]
    assert CliRunner().invoke(make_commands(), ["info", str(path)]).exit_code == 0
    if path.is_file():  # what lies beside it is no data set of its own
        shutil.rmtree(tmp_path / "packed")
        with pytest.raises(DatasetError, match=f"found none; open {path}$"):
            open_dataset(path.parent)


def test_the_answers_on_a_copy_go_to_the_copy(tmp_path: Path) -> None:
    original = of_a_build(tmp_path)
    manifest_s = tmp_path / "data_manifests" / "overrides.toml"
    (original / ".build").mkdir()
    write_build_record(original, BuildRecord(BuildCommand((), {"overrides": str(manifest_s)})))
    (original / "manifest.json").write_text("{}")
    with served(original) as client:
        keep(client)
    for copy, how in (("copy", shutil.copy2), ("links", os.link)):
        shutil.copytree(original, tmp_path / copy, copy_function=how)
        with served(tmp_path / copy) as client:
            keep(client, "sure")
        assert "[sure]" in (tmp_path / copy / "overrides.toml").read_text()
        assert len((tmp_path / copy / "overrides.log.jsonl").read_bytes().splitlines()) == 2
    assert "[sure]" not in (original / "overrides.toml").read_text()
    assert len((original / "overrides.log.jsonl").read_bytes().splitlines()) == 1
    assert not manifest_s.exists()


@pytest.mark.parametrize("name", ["overrides.toml", "overrides.log.jsonl", ".overrides.lock"])
@pytest.mark.parametrize("there", [True, False])
def test_no_link_in_a_data_set_is_written_through(name: str, there: bool, tmp_path: Path) -> None:
    path, outside = flat(tmp_path), tmp_path / "mine.toml"
    if there:
        outside.write_text("[mine]\n")
    (path / name).symlink_to(outside)
    with served(path) as client:
        answer = client.post("/houses/review/decide", json={"plan": "doubtful", "action": "keep", "reviewer": "ann"})
        assert answer.status_code == 400, answer.text
        assert f"{path.name}/{name}: expected a file or nothing, found a link" in answer.json()["error"]
    with pytest.raises(ConfigError, match="found a link"):
        DecisionStore(overrides_path(path)).check()
    assert outside.read_text() == "[mine]\n" if there else not outside.exists()
    assert {file.name for file in path.iterdir()} == {"doubtful.json", "sure.json", name}


def test_a_place_that_cannot_be_written_is_told_before_anybody_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = flat(tmp_path)
    DecisionStore(overrides_path(path)).check()
    monkeypatch.setattr("houseexpo.service.review.decisions._may_write", lambda _: False)
    result = CliRunner().invoke(make_commands(), ["serve", str(path), "--review", "--port", "0"])
    assert result.exit_code == 2
    assert f"{path / 'overrides.toml'}: decisions go to this file, and it cannot be written; copy" in result.output


def test_what_a_record_from_elsewhere_says_is_shown_and_never_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = built(tmp_path / "houses", some_plans())
    (path / ".build").mkdir()
    hostile = BuildCommand(
        ("s3://theirs/houses",), {"executor": "ray", "address": "10.0.0.1:6379", "config": "/etc/passwd"}
    )
    (path / FILE).write_bytes(encode_build_record(BuildRecord(hostile)))
    monkeypatch.setattr("subprocess.Popen", lambda *_, **__: pytest.fail("it was run"))
    with served(path) as client:
        found = client.get("/houses/review/build").json()
        assert "built in another place or by somebody else" in found["refusal"]
        assert f"houseexpo build --config=/etc/passwd --out {path} -- s3://theirs/houses" in found["refusal"]
        assert "confirm" not in found
        answer = client.post("/houses/review/build", json={"reviewer": "ann", "confirm": ""})
        assert answer.status_code == 400


def test_what_runs_is_what_was_confirmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = built(tmp_path / "houses", some_plans())
    (path / ".build").mkdir()
    write_build_record(path, BuildRecord(BuildCommand(("procedural:2",), {"seed": "1"})))
    monkeypatch.setattr("subprocess.Popen", lambda *_, **__: pytest.fail("it was run"))
    with served(path) as client:
        seen = client.get("/houses/review/build").json()
        assert seen["commands"] == [f"houseexpo build --seed=1 --out {path} -- procedural:2"]
        write_build_record(path, BuildRecord(BuildCommand(("procedural:2",), {"seed": "2"})))
        for confirm in (seen["confirm"], "", "x"):
            answer = client.post("/houses/review/build", json={"reviewer": "ann", "confirm": confirm})
            assert answer.status_code == 409
        assert client.post("/houses/review/build", json={"reviewer": "ann"}).status_code == 400
