"""The home page of a data set, and the page of all of them: what strangers wrote is shown, and does nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("starlette")

from starlette.testclient import TestClient

from houseexpo.service.app import make_app
from tests.builders.services import BASE, service_of

HTML = {"accept": "text/html"}


def client_of(*paths: Path) -> TestClient:
    return TestClient(make_app(service_of(*paths)), base_url=BASE, follow_redirects=False)


def test_the_page_says_what_the_data_set_is_and_how_to_open_it(client: TestClient) -> None:
    page = client.get("/homes/about", headers=HTML).text
    for words in ("4 floor plans", "No licence recorded", "<dd>4</dd>", "2 rooms, 21 m²", "Kitchen"):
        assert words in page
    assert "inputs that gave no plan" in page
    assert "houseexpo.open_dataset(" in page
    assert "/homes/plan/d%204%26%C3%A9" in page


def test_a_release_says_itself_what_it_is(folder: Path) -> None:
    told = {
        "name": "Homes of 2026",
        "description": "What they are.",
        "license": "https://example.org/by",
        "version": "1.2",
    }
    (folder / "croissant.json").write_text(json.dumps(told))
    page = client_of(folder).get("/homes/about", headers=HTML).text
    assert all(words in page for words in told.values())


@pytest.mark.parametrize(
    "text",
    [
        '{"name": "<script>alert(1)</script>", "description": "<img src=x onerror=alert(1)>"}',
        '{"name": {"a": 1}, "license": [1], "sources": {"x": 1}, "generator": "me"}',
        "[" * 100_000,
        "not json",
        '{"sources": [1, null, "/home/somebody/secret"]}',
    ],
)
def test_what_strangers_wrote_is_text(folder: Path, text: str) -> None:
    (folder / "croissant.json").write_text(text)
    (folder / "manifest.json").write_text(text)
    answer = client_of(folder).get("/homes/about", headers=HTML)
    assert answer.status_code == 200
    assert "<script>alert" not in answer.text
    assert "<img src=x" not in answer.text
    assert "somebody" not in answer.text


def test_a_link_is_not_followed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_text('{"description": "of another"}')
    (folder / "croissant.json").symlink_to(tmp_path / "secret.json")
    assert "of another" not in client_of(folder).get("/homes/about", headers=HTML).text


def test_several_data_sets_are_listed_and_one_is_shown_at_once(client: TestClient, folder: Path) -> None:
    page = client.get("/", headers=HTML).text
    assert 'href="/homes/about"' in page
    assert 'href="/published/about"' in page
    assert client_of(folder).get("/").headers["location"] == "/homes/"
