"""Tags: they are kept beside the plans, filter them, and cost nothing where their file is damaged."""

from __future__ import annotations

import io
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

pytest.importorskip("starlette")

from starlette.testclient import TestClient

from houseexpo import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.service.app import make_app
from houseexpo.service.service import Service
from houseexpo.service.tags import TagStore, check_name
from tests.builders.services import BASE, service_of


def tag(client: TestClient, name: str, **values: object) -> dict[str, dict[str, object]]:
    answer = client.post("/api/homes/tags", json={"tag": name, **values})
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_tag_is_given_found_and_taken_away(client: TestClient, folder: Path) -> None:
    assert tag(client, "night  run", ids=["a1", "c3"])["tags"] == {"night run": 2}
    assert client.get("/api/homes/ids.txt?tags=night run").text == "a1\nc3\n"
    facets = client.get("/api/homes/facets?tags=night run&labels=Garage").json()
    assert (facets["found"], facets["tags"]) == (0, {"night run": 0})
    assert facets["without"] == {"tags=night run": 1, "labels=Garage": 2}
    plans = client.get("/api/homes/plans?columns=tags").json()["plans"]
    assert {each["id"]: each.get("tags") for each in plans}["a1"] == ["night run"]
    assert "night run" in client.get("/homes/plan/a1").text
    assert tag(client, "night run", ids=["a1"], remove=True)["tags"] == {"night run": 1}
    assert tag(client, "night run", query={"labels": "Garage"})["tags"] == {"night run": 2}
    assert len(open_dataset(folder)) == 4  # the file of tags is no plan


def test_an_unknown_tag_is_said(client: TestClient) -> None:
    answer = client.get("/api/homes/plans?tags=nihgt")
    assert answer.status_code == 400
    assert "tags: no 'nihgt' in this data set; its tags: none" in answer.json()["error"]


@pytest.mark.parametrize("name", ["", " ", "a,b", "x" * 61, "a\x00b", "\u202eb"])
def test_a_name_that_cannot_be_one_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="expected a name of 1 to 60 letters"):
        check_name(name)


@pytest.mark.parametrize("name", ['"quoted"', "back\\slash", "]", "ünï 家", "#"])
def test_any_other_name_is_read_as_it_was_written(folder: Path, name: str) -> None:
    TagStore(folder).tag(name, ["d 4&é", "a1"])
    assert TagStore(folder).now() == {name: ("d 4&é", "a1")}


def test_what_two_servers_write_is_all_there(folder: Path) -> None:
    servers = [TagStore(folder), TagStore(folder)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda number: servers[number % 2].tag(f"t{number}", ["a1"]), range(40)))
    assert set(TagStore(folder).now()) == {f"t{number}" for number in range(40)}


def test_a_damaged_file_of_tags_costs_the_tags_alone(client: TestClient, folder: Path) -> None:
    (folder / "tags.toml").write_text("[tags\n")
    assert client.get("/api/homes/plans").status_code == 200
    assert client.get("/homes/plan/a1").status_code == 200
    answer = client.get("/api/homes/tags")
    assert answer.status_code == 400
    assert "tags.toml: cannot be read" in answer.json()["error"]
    assert client.post("/api/homes/tags", json={"tag": "x", "ids": ["a1"]}).status_code == 400
    assert (folder / "tags.toml").read_text() == "[tags\n"  # nothing is lost


def test_a_link_is_not_followed(client: TestClient, folder: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret.toml"
    secret.write_text('[tags]\n"secret" = ["a1"]\n')
    (folder / "tags.toml").symlink_to(secret)
    assert "secret" not in client.get("/api/homes/facets").text
    assert "found a link" in client.post("/api/homes/tags", json={"tag": "x", "ids": ["a1"]}).json()["error"]
    assert secret.read_text() == '[tags]\n"secret" = ["a1"]\n'


def test_nothing_is_written_read_only_or_where_it_cannot_be(folder: Path) -> None:
    client = TestClient(make_app(service_of(folder, read_only=True)), base_url=BASE)
    assert client.post("/api/homes/tags", json={"tag": "x", "ids": ["a1"]}).status_code == 403
    assert not client.get("/api/homes/tags").json()["writable"]
    assert not (folder / "tags.toml").exists()


@pytest.mark.parametrize(
    "body",
    [b"", b"[]", b'{"tag": 1}', b'{"tag": "x", "ids": ["no such plan"]}', b'{"tag": "x", "q": 1}', b'{"tag": "x"}'],
)
def test_a_body_that_is_something_else_changes_nothing(client: TestClient, folder: Path, body: bytes) -> None:
    answer = client.post("/api/homes/tags", content=body)
    assert answer.status_code in (400, 404)
    assert answer.json()["error"]
    assert not (folder / "tags.toml").exists()


def test_a_selection_is_downloaded_in_a_format(client: TestClient, service: Service) -> None:
    answer = client.get("/api/homes/export/geojson?ids=a1,d%204%26%C3%A9")
    assert answer.headers["content-disposition"] == "attachment; filename*=utf-8''homes-geojson.zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert [Path(name).suffix for name in archive.namelist()] == [".geojson", ".geojson"]
    every = client.get("/api/homes/export/svg?labels=Garage")
    with zipfile.ZipFile(io.BytesIO(every.content)) as archive:
        assert len(archive.namelist()) == 1
    assert "found 0" in client.get("/api/homes/export/svg?rooms=99").json()["error"]
    assert client.get("/api/homes/export/exe").status_code == 404
    assert client.get("/api/homes/export/svg?ids=nobody").status_code == 404
