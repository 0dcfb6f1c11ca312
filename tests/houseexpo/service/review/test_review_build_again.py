"""Build again does what was decided, on what it touches, and shows before and after."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
from starlette.testclient import TestClient
from typer.testing import CliRunner

from houseexpo.commands.app import make_app as make_commands
from houseexpo.dataset import open_dataset
from houseexpo.dataset.build_record import read_build_record
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.service import Service, ServiceSettings
from tests.builders.batch import one_room
from tests.builders.bungalow import BEDROOM_DOOR, FILE, PATIO

pytestmark = pytest.mark.slow
MANIFEST = '[build]\nsources = ["houses"]\nmin_quality = 0.0\n'


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a data set of a bungalow that is wrong and a hut that is right, with a manifest."""
    folder: Path = tmp_path_factory.mktemp("home")
    (folder / "houses").mkdir()
    shutil.copy(FILE, folder / "houses" / "bungalow.obj")
    one_room(folder / "houses" / "hut.ply")
    (folder / "homes.toml").write_text(MANIFEST)
    words = ["build", "--config", str(folder / "homes.toml"), "--out", str(folder / "plans"), "--workers", "1"]
    result = CliRunner().invoke(make_commands(), words)
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture
def client(home: Path) -> Iterator[TestClient]:
    service = Service({"plans": Collection("plans", home / "plans")}, ServiceSettings(review=True))
    with TestClient(make_app(service), base_url="http://127.0.0.1") as found:
        yield found


def post(client: TestClient, path: str, **words: Any) -> dict[str, Any]:
    answer = client.post(f"/plans/review/{path}", json={"reviewer": "ann", **words})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def built(client: TestClient) -> dict[str, Any]:
    post(client, "build", confirm=client.get("/plans/review/build").json()["confirm"])
    for _ in range(1200):
        found: dict[str, Any] = client.get("/plans/review/build").json()
        if found["phase"] != "building":
            return found
        time.sleep(0.1)
    raise TimeoutError(found["lines"])


def test_a_build_says_how_it_was_made(home: Path) -> None:
    found = read_build_record(home / "plans")
    assert found is not None
    assert found.build.options == {"config": str(home / "homes.toml")}


def test_build_again_does_what_was_decided(client: TestClient, home: Path) -> None:
    (home / "plans" / "overrides.toml").write_text("# seen on site\n")
    hut = home / "plans" / "json"
    (name,) = (file.stem for file in hut.iterdir() if "bungalow" in file.name)
    untouched = {file: file.stat().st_mtime_ns for file in hut.iterdir() if name not in file.name}
    before = client.get(f"/plans/review/pictures/{name}.svg").text
    frame = client.get("/plans/review/state", params={"plan": name}).json()
    post(client, "decide", plan=name, action="door", points=at(home, name, BEDROOM_DOOR))
    post(client, "decide", plan=name, action="no_room", points=at(home, name, [PATIO]), seen=1)
    found = built(client)
    assert found["phase"] == "built", found["lines"]
    (outcome,) = found["outcomes"]
    assert (outcome["plan"], outcome["became"], outcome["why"], outcome["idle"]) == (name, "changed", "", [])
    assert [said.split()[0] for said in outcome["effects"][:2]] == ["door", "no_room"]
    assert found["waiting"] == 0
    assert client.get(f"/plans/review/pictures/{name}.svg?when=before").text == before
    after = client.get("/plans/review/state", params={"plan": name}).json()
    assert after["quality"] > frame["quality"]
    assert after["doors"] == 3
    assert {file: file.stat().st_mtime_ns for file in untouched} == untouched
    assert (home / "plans" / "overrides.toml").read_text().startswith("# seen on site\n")
    assert not (home / "overrides.toml").exists()  # what lies beside the manifest is the person's own


def test_what_is_dropped_is_gone_and_says_why(client: TestClient) -> None:
    names = [client.get("/plans/review/state", params={"move": "next", "plan": ""}).json()["plan"]]
    names.append(client.get("/plans/review/state", params={"move": "next", "plan": names[0]}).json()["plan"])
    hut = next(name for name in names if "hut" in name)
    post(client, "decide", plan=hut, action="drop", text="no home")
    found = built(client)
    assert found["phase"] == "built", found["lines"]
    (outcome,) = found["outcomes"]
    assert (outcome["plan"], outcome["became"]) == (hut, "gone")
    assert outcome["why"]
    assert client.get("/plans/review/state").json()["progress"]["plans"] == 1


def test_a_build_that_fails_says_why_and_loses_no_decision(client: TestClient, home: Path) -> None:
    manifest = home / "homes.toml"
    manifest.write_text(MANIFEST.replace("min_quality", "mine_quality"))
    try:
        shown = client.get("/plans/review/state").json()
        post(client, "decide", plan=shown["plan"], action="keep", seen=shown["seen"])
        found = built(client)
        assert found["phase"] == "failed"
        assert any("mine_quality" in line for line in found["lines"])
        assert found["waiting"] == 1
        assert "keep = true" in (home / "plans" / "overrides.toml").read_text()
    finally:
        manifest.write_text(MANIFEST)


def test_what_is_decided_on_plans_that_an_earlier_build_made_is_done_too(tmp_path: Path) -> None:
    one_room(tmp_path / "a" / "hut.ply")
    one_room(tmp_path / "b" / "barn.ply", 9.0, 7.0)
    out = tmp_path / "plans"
    for words in (["a"], ["b", "--add"]):
        source, *others = words
        command = ["build", str(tmp_path / source), *others, "--out", str(out), "--workers", "1"]
        assert CliRunner().invoke(make_commands(), command).exit_code == 0
    service = Service({"plans": Collection("plans", out)}, ServiceSettings(review=True))
    with TestClient(make_app(service), base_url="http://127.0.0.1") as client:
        for name in ("hut", "barn"):
            post(client, "decide", plan=name, action="drop", text="no home")
        found = built(client)
        assert found["phase"] == "built", found["lines"]
        assert {each["plan"]: each["became"] for each in found["outcomes"]} == {"hut": "gone", "barn": "gone"}
    assert not list((out / "json").iterdir())
    command = ["build", str(tmp_path / "a"), str(tmp_path / "b"), "--out", str(out), "--workers", "1"]
    assert CliRunner().invoke(make_commands(), command).exit_code == 0
    assert not list((out / "json").iterdir())  # the next build reads what was decided, whoever begins it


def at(home: Path, name: str, points: Any) -> list[list[float]]:
    """Return points of the source in the plan's metres."""
    plan = open_dataset(home / "plans")[name]
    assert plan.frame is not None
    found: list[list[float]] = plan_points_from_source(plan.frame, points).tolist()
    return found
