"""One plan in ``/api``: its JSON, pictures and files, and what is computed of it."""

from __future__ import annotations

import base64
import hashlib
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from houseexpo.dataset import open_dataset
from houseexpo.drawing.scene import lay_out_plan
from houseexpo.exports import FORMATS
from houseexpo.floorplan import FloorPlan
from houseexpo.service.app import make_app
from tests.builders.services import BASE, built, service_of

ODD = "/api/homes/plans/d%204%26%C3%A9"


def test_a_plan_is_as_it_is_packed_and_known_by_its_tag(client: TestClient, folder: Path) -> None:
    data = (folder / "json" / "d 4&é.json").read_bytes()
    found = client.get(ODD)
    assert found.content == data
    assert found.headers["etag"] == f'"{hashlib.sha1(data, usedforsecurity=False).hexdigest()}"'
    again = client.get(ODD, headers={"if-none-match": found.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert client.get(ODD, headers={"if-none-match": '"other"'}).status_code == 200


def test_pictures_are_svg_that_can_do_nothing(client: TestClient) -> None:
    for name in ("thumbnail.svg", "picture.svg"):
        for plan in ("/api/homes/plans/a1", "/api/published/plans/" + f"{3:032x}"):
            found = client.get(f"{plan}/{name}")
            assert found.headers["content-type"].startswith("image/svg+xml")
            assert found.text.startswith("<svg")
            assert "<script" not in found.text
            assert "style=" not in found.text
    assert "sandbox" in client.get("/api/homes/plans/a1/picture.svg").headers["content-security-policy"]


NEEDS = {"dxf": "ezdxf", "ifc": "ifcopenshell"}
"""Formats that an extra writes."""


@pytest.mark.parametrize("form", sorted(FORMATS))
def test_every_format_is_offered(client: TestClient, form: str) -> None:
    if form in NEEDS:
        pytest.importorskip(NEEDS[form])
    found = client.get(f"{ODD}/export/{form}")
    assert found.status_code == 200, found.text
    assert "attachment" in found.headers["content-disposition"]
    assert found.content
    assert client.get(f"{ODD}/export/{form}").content == found.content
    if found.headers["content-type"] == "application/zip":
        archive = zipfile.ZipFile(io.BytesIO(found.content))
        assert archive.testzip() is None
        assert {each.compress_type for each in archive.infolist()} == {zipfile.ZIP_DEFLATED}
    assert client.get("/api/homes/plans/a1/export/exe").status_code == 404


def test_a_shape_has_all_that_the_plan_records(client: TestClient) -> None:
    found = client.get("/api/homes/plans/a1/shape").json()
    assert found["bounds"] == [0.1, 0.1, 7.2, 3.1]
    assert [room["label"] for room in found["rooms"]] == ["Kitchen", "Bedroom"]
    assert found["doors"][0]["rooms"] == [0, 1]
    assert len(found["walls"]) == 2  # a ring has an inside and an outside
    assert found["boxes"][0]["box"] == [0.1, 0.1, 4.1, 3.1]


def test_words_stand_where_a_picture_of_the_same_scale_has_them(client: TestClient, folder: Path) -> None:
    plan = open_dataset(folder)["a1"]
    for each in client.get("/api/homes/plans/a1/shape").json()["words"]:
        found = [(*text["at"], *text["lines"]) for text in each["texts"]]
        scene = lay_out_plan(plan, each["scale"], 0)
        assert found == [(round(text.x, 3), round(text.y, 3), *text.lines) for text in scene.words]
    assert found


def test_rooms_of_an_outline_are_found_when_asked_for(client: TestClient) -> None:
    name = f"/api/published/plans/{2:032x}"
    assert client.get(f"{name}/shape").json()["rooms"] == []
    assert [room["label"] for room in client.get(f"{name}/rooms").json()["rooms"]] == ["Kitchen"]


def test_reach_depends_on_the_radius(client: TestClient) -> None:
    small = client.get("/api/homes/plans/a1/reach?radius=0.2").json()
    assert (small["components"], len(small["pieces"])) == (1, 1)
    assert small["narrowest"] == pytest.approx(0.8, abs=0.02)
    large = client.get("/api/homes/plans/a1/reach?radius=0.45").json()
    assert large["components"] == 2
    assert [piece["area"] for piece in large["pieces"]] == pytest.approx([3.1 * 2.1, 2.1 * 2.1], abs=0.1)
    nowhere = client.get("/api/homes/plans/a1/reach?radius=1.9").json()
    assert (nowhere["components"], nowhere["pieces"]) == (0, [])


def test_a_way_leads_through_the_door_where_the_robot_fits(client: TestClient) -> None:
    ask = "/api/homes/plans/a1/way?from=1.1,1.5&to=6.2,1.5&radius="
    straight = client.get(f"{ask}0.2").json()
    assert (straight["found"], straight["length"]) == (True, pytest.approx(5.1))
    assert client.get(f"{ask}0.45").json()["why"].startswith("No path")
    assert client.get(f"{ask}1.9").json()["why"] == "The robot fits nowhere."
    assert "outside" in client.get("/api/homes/plans/a1/way?from=1,1&to=50,50").json()["why"]


def test_clearance_is_a_picture_of_the_plan(client: TestClient) -> None:
    import cv2

    found = client.get("/api/homes/plans/a1/clearance").json()
    assert found["most"] == pytest.approx(1.5, abs=0.05)
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(found["png"]), np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture[0, 0, 3] == 0
    assert picture[picture.shape[0] // 2, picture.shape[1] // 4, 3] > 0


def test_similar_plans_come_in_the_order_of_their_difference(client: TestClient) -> None:
    found = client.get("/api/homes/plans/a1/similar").json()["similar"]
    assert [each["id"] for each in found] == ["d 4&é", "b2", "c3"]
    differences = [each["difference"] for each in found]
    assert differences == sorted(differences)
    assert differences[0] < 0.02 < differences[1]


@pytest.mark.parametrize("asked_before", [False, True])
def test_a_similar_plan_that_was_deleted_is_left_out(client: TestClient, folder: Path, asked_before: bool) -> None:
    client.get("/api/homes/plans/a1/similar" if asked_before else "/api/homes/facets")
    (folder / "json" / "b2.json").unlink()
    found = client.get("/api/homes/plans/a1/similar").json()["similar"]
    assert [each["id"] for each in found] == ["d 4&é", "c3"]


def test_a_plan_of_thousands_of_vertices_is_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    angles = np.linspace(0, 2 * np.pi, 12_000, endpoint=False)
    radii = 9 + 0.004 * (np.arange(12_000) % 2)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1) + 9.2
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    plan = FloorPlan("round", ring.round(4), 1, {"Hall": [(0, 0, 18, 18)]})
    client = TestClient(make_app(service_of(built(tmp_path / "one", [plan]))), base_url=BASE)
    assert len(client.get("/api/one/plans/round/thumbnail.svg").content) < 40_000
    for path in ("shape", "reach?radius=0.3", "clearance", "way?from=2,9&to=16,9"):
        assert client.get(f"/api/one/plans/round/{path}").status_code == 200, path


def test_a_selection_is_downloaded_in_a_format(client: TestClient) -> None:
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
