"""The pages: they come whole, quote what they show, and say in words what went wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from houseexpo.dataset.index import index_table
from houseexpo.dataset.store.folders import rejected_picture_path
from houseexpo.service.app import make_app
from tests.builders.services import BASE, published, service_of

PAGES = (
    *("/homes/", "/homes/plan/a1", "/homes/plan/d%204%26%C3%A9", "/homes/refused", "/homes/statistics", "/api"),
    *("/published/", f"/published/plan/{1:032x}", "/published/refused", "/published/statistics?rooms=2.."),
)


@pytest.mark.parametrize("path", PAGES)
def test_a_page_loads_from_here_only(client: TestClient, path: str) -> None:
    found = client.get(path)
    assert found.status_code == 200
    for url in re.findall(r'(?:src|href)="([^"]*)"', found.text):
        assert url.startswith(("/", "?", "#")), url
        assert not url.startswith("//")
    assert not re.search(r"<script(?![^>]*src=)|\son\w+=|\sstyle=", found.text)  # the policy would refuse them
    assert found.text.count("<h1") == 1
    assert "default-src 'self'" in found.headers["content-security-policy"]


def test_what_a_page_loads_is_there(client: TestClient) -> None:
    for path in PAGES:
        for url in re.findall(r'(?:src|href)="(/static/[^"]*)"', client.get(path).text):
            assert client.get(url).status_code == 200, url
    script = client.get("/static/gallery.js")
    assert script.headers["content-type"].startswith("text/javascript")
    assert client.get("/static/gallery.js", headers={"if-none-match": script.headers["etag"]}).status_code == 304
    for url in re.findall(r'from "\./([\w.]+)"', script.text):
        assert client.get(f"/static/{url}").status_code == 200


def test_a_data_set_without_plans_is_shown(folder: Path, tmp_path: Path) -> None:
    for file in (folder / "json").iterdir():
        file.unlink()
    (folder / "index.parquet").write_bytes(index_table([]))
    client = TestClient(make_app(service_of(folder, published(tmp_path / "published.jsonl", 2))), base_url=BASE)
    (folder / "rejected.jsonl").write_bytes(b"")
    (folder / "duplicates.jsonl").write_bytes(b"")
    for page in ("", "statistics", "refused"):
        assert client.get(f"/homes/{page}").status_code == 200, page
    assert "No input was rejected" in client.get("/homes/refused").text
    assert "only a folder written by" in client.get("/published/refused").text
    for values in ("plans?sort=-area&text=a", "facets", "ids.txt", "statistics", "index.parquet"):
        assert client.get(f"/api/homes/{values}").status_code == 200, values
    assert client.get("/homes/plan/a1").status_code == 404


def test_a_plans_page_says_what_is_known(client: TestClient) -> None:
    text = client.get("/homes/plan/a1?quality=0.7..&sort=-quality").text
    assert "1 of 3" in text
    assert 'href="/homes/plan/d%204%26%C3%A9?quality=0.7..&amp;sort=-quality"' in text
    assert "a1.glb" in text
    assert "train" in text
    assert "twin" in text
    assert "open_dataset(&#34;http://localhost:8000/homes&#34;)" in text


def test_a_plan_that_the_filter_leaves_out_has_no_neighbours(client: TestClient) -> None:
    text = client.get("/homes/plan/b2?quality=0.7..").text
    assert 'id="after"' not in text
    assert "b2" in text


def test_what_was_refused_is_quoted(client: TestClient) -> None:
    text = client.get("/homes/refused").text
    assert "&lt;b&gt;hut&lt;/b&gt;" in text
    assert "<b>hut" not in text
    assert "twin" in text
    assert "<td>car</td>" not in client.get("/homes/refused?stage=rooms&reason=too_small").text
    assert "has no list of rejected inputs" in client.get("/published/refused").text


def test_lists_that_are_damaged_are_said(folder: Path) -> None:
    (folder / "rejected.jsonl").write_bytes(b'{"id": "cut off')
    client = TestClient(make_app(service_of(folder)), base_url=BASE)
    assert "rejected.jsonl: cannot be read" in client.get("/homes/refused").text


def test_a_picture_of_a_dropped_plan_is_shown_where_the_build_kept_one(client: TestClient, folder: Path) -> None:
    pictures = folder / ".build" / "pictures"
    assert "no picture" in client.get("/homes/refused").text
    pictures.mkdir(parents=True)
    (pictures / "twin.png").write_bytes(b"\x89PNG")
    assert client.get("/api/homes/duplicates/twin/picture.png").content == b"\x89PNG"
    (pictures / "a1.png").write_bytes(b"\x89PNG")
    assert client.get("/api/homes/duplicates/a1/picture.png").status_code == 404  # it was not dropped


def test_a_picture_of_what_was_refused_is_shown_where_the_build_kept_one(client: TestClient, folder: Path) -> None:
    file = rejected_picture_path(folder, "<b>hut</b>")
    file.parent.mkdir(parents=True)
    file.write_bytes(b"\x89PNG")
    assert client.get("/homes/refused").text.count('class="drawn"') == 1
    asked = "/api/homes/refused/picture.png"
    assert client.get(asked, params={"id": "<b>hut</b>"}).content == b"\x89PNG"
    for name in ("car", "../hut", "twin", ""):
        assert client.get(asked, params={"id": name}).status_code == 404
    file.rename(folder / "away.png")
    file.symlink_to(folder / "away.png")
    assert client.get(asked, params={"id": "<b>hut</b>"}).status_code == 404


def test_an_error_is_a_page_for_people(client: TestClient) -> None:
    found = client.get("/homes/plan/nobody", headers={"accept": "text/html"})
    assert found.status_code == 404
    assert "Not found" in found.text
    assert "No plan &#39;nobody&#39;" in found.text
    assert "Traceback" not in found.text
