"""``/api``: what programs get, its tags, parts of files, its own description, and what it says to bad input."""

from __future__ import annotations

import io
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from starlette.testclient import TestClient

from houseexpo.dataset.store.folders import rejected_picture_path
from houseexpo.service.api import CALLS, ApiCall
from houseexpo.service.app import make_app
from houseexpo.service.service import Service
from tests.builders.services import BASE, built, service_of, some_plans, two_rooms


def test_data_sets_say_what_they_are(client: TestClient) -> None:
    found = client.get("/api/data").json()["data"]
    assert [(each["name"], each["plans"]) for each in found] == [("homes", 4), ("published", 12)]
    assert found[0]["splits"] == {"train": 2}
    assert found[0] == client.get("/api/homes").json()


@pytest.mark.parametrize(("folder", "name"), [("data", "data-2"), ("é", "plans")])
def test_no_data_set_takes_an_address_of_the_service(tmp_path: Path, folder: str, name: str) -> None:
    service = service_of(built(tmp_path / "in" / folder, some_plans()))
    client = TestClient(make_app(service), base_url=BASE)
    assert client.get(f"/api/{name}").json()["plans"] == 4
    assert client.get("/api/data").json()["data"][0]["name"] == name


def test_plans_come_by_the_page(client: TestClient) -> None:
    first = client.get("/api/published/plans?limit=5&sort=-area").json()
    assert (first["found"], first["next"], len(first["plans"])) == (12, 5, 5)
    last = client.get("/api/published/plans?limit=5&offset=10&sort=-area").json()
    assert (last["next"], len(last["plans"])) == (None, 2)
    areas = [line["area"] for line in [*first["plans"], *last["plans"]]]
    assert areas == sorted(areas, reverse=True)
    assert client.get("/api/published/plans?limit=5&offset=99").json()["plans"] == []


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("plans?split=tset", "no 'tset' in this data set; it has: train"),
        ("plans?source=ifc", "it has: made"),
        ("ids.txt?limit=2", "found 'limit'"),
        ("facets?offset=2", "found 'offset'"),
        ("plans?rooms=1_0", "rooms: expected a number"),
        ("plans?rooms=%EF%BC%92", "rooms: expected a number"),
        ("plans?area=inf", "area: expected a number"),
        ("plans/a1/way?from=1,1&to=1e308,1", "to: expected a point"),
        ("export/svg?idd=a1", "found 'idd'; did you mean 'ids'?"),
        ("plans/a1/reach?raduis=0.3", "query: expected radius; found 'raduis'; did you mean 'radius'?"),
        ("plans/a1/similar?most=3", "query: expected no parameter; found 'most'"),
        ("plans?roms=4", "radius, sort, offset, limit, columns, view; found 'roms'; did you mean 'rooms'?"),
        ("plans/a1/reach?radius=0.2&radius=0.3", "radius: expected once, found 2 of it"),
    ],
)
def test_what_means_nothing_here_is_not_passed_over(client: TestClient, asked: str, words: str) -> None:
    found = client.get(f"/api/homes/{asked}")
    assert found.status_code == 400
    assert words in found.json()["error"]


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.path)
def test_every_address_refuses_parameters_that_it_does_not_take(client: TestClient, call: ApiCall) -> None:
    path = call.path.format(data="homes", plan="a1", form="svg", name="train")
    for asked in ("resolutoin=1", "resolutoin=", "radius=0.20&RADIUS=0.3", "token=x&limit[]=1"):
        found = client.get(f"{path}?{asked}", headers={"accept": "text/html"})
        assert found.status_code == 400
        assert "query: expected" in found.json()["error"]


def test_parameters_of_a_page_may_stand_in_its_filter(client: TestClient) -> None:
    for name in ("plans", "facets", "ids.txt", "statistics"):
        assert client.get(f"/api/homes/{name}?view=table&columns=area&sort=-area&token=").status_code == 200, name


def test_ids_and_splits_are_lists(client: TestClient) -> None:
    assert client.get("/api/homes/ids.txt?quality=0.8..").text.splitlines() == ["a1", "d 4&é"]
    assert client.get("/api/homes/splits/train").text == "a1\nc3\n"
    assert client.get("/api/homes/splits/val").status_code == 404


def test_the_index_is_a_parquet_file_that_is_read_in_parts(client: TestClient) -> None:
    whole = client.get("/api/homes/index.parquet")
    table = pq.read_table(io.BytesIO(whole.content))
    assert table.column("id").to_pylist() == ["a1", "b2", "c3", "d 4&é"]
    assert client.get("/api/homes/index.parquet").headers["etag"] == whole.headers["etag"]
    size = len(whole.content)
    parts = {"0-3": (0, 4), "-4": (size - 4, size), f"{size - 1}-": (size - 1, size), "5-99999999": (5, size)}
    for asked, (first, last) in parts.items():
        part = client.get("/api/homes/index.parquet", headers={"range": f"bytes={asked}"})
        assert part.status_code == 206
        assert part.content == whole.content[first:last]
        assert part.headers["content-range"] == f"bytes {first}-{last - 1}/{size}"
    for asked in ("bytes=99999999-", "bytes=5-3"):
        assert client.get("/api/homes/index.parquet", headers={"range": asked}).status_code == 416, asked
    for asked in ("bytes=0-1,3-4", "lines=1-2", "bytes=-"):
        assert client.get("/api/homes/index.parquet", headers={"range": asked}).content == whole.content, asked
    changed = {"range": "bytes=0-3", "if-range": '"other"'}
    assert client.get("/api/homes/index.parquet", headers=changed).content == whole.content


def test_statistics_follow_the_filter(client: TestClient) -> None:
    found = client.get("/api/homes/statistics?quality=0.8..").json()
    assert (found["found"], found["total"]) == (2, 4)
    quality = found["measures"]["quality"]
    assert (quality["known"], quality["mean"]) == (2, pytest.approx(0.9))
    assert sum(quality["counts"]) == 2
    assert found["labels"]["Bedroom"] == 0.5


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/api/nowhere", 404, "no data set 'nowhere'; the data sets: "),
        ("/api/homes/plans/nobody", 404, "no plan 'nobody' in this data set"),
        ("/api/homes/plans/%00", 404, "no "),
        ("/api/homes/plans?limit=100000", 400, "limit: expected a whole number, 1 to 500"),
        ("/api/homes/plans?limit=0", 400, "limit: expected a whole number, 1 to 500"),
        ("/api/homes/plans?offset=-1", 400, "offset"),
        ("/api/homes/plans?limit=%D9%A3", 400, "limit"),
        ("/api/homes/plans?rooms=1e999..&area=x", 400, "area"),
        ("/api/homes/plans?labels=%3Cscript%3E", 400, "labels"),
        ("/api/homes/plans/a1/reach?radius=-1", 400, "radius: expected metres"),
        ("/api/homes/plans/a1/reach?radius=1e9", 400, "radius: expected metres"),
        ("/api/homes/plans/a1/way?from=1,2", 400, "to: expected a point"),
        ("/api/homes/plans/a1/way?from=1,2,3&to=nan,nan", 400, "from: expected a point"),
        ("/nothing/at/all", 404, "Not Found"),
    ],
)
def test_what_cannot_be_answered_is_said(client: TestClient, path: str, status: int, said: str) -> None:
    found = client.get(path)
    assert found.status_code == status
    assert said in found.json()["error"]


def test_every_route_is_listed_and_nothing_else(service: Service) -> None:
    routes = {getattr(route, "path", "") for route in make_app(service).routes}
    served = {path for path in routes if path.startswith("/api/")} - {"/api/"}
    assert served == {call.path for call in CALLS}


def test_a_query_parameter_that_is_described_is_taken(client: TestClient, folder: Path) -> None:
    words = dict.fromkeys(("text", "stage", "reason"), "x") | {"source": "made", "split": "train"}
    words |= {"labels": "Kitchen", "without": "Hall", "radius": "0.2", "sort": "id"}
    words |= {"offset": "0", "limit": "3", "from": "1,1", "to": "2,2", "id": "car"}
    words |= {"ids": "a1", "columns": "area,labels"}
    keep_picture(folder)
    for call in CALLS:
        path = call.path.format(data="homes", plan="a1", form="svg", name="train")
        for name in call.query:
            needed = {each: words[each] for each in ("from", "to") if each in call.query}
            given = needed | {name: words.get(name, "1..")}
            answer = client.get(path, params=given)
            assert answer.status_code == 200 or "1 to 500 plans, found 0" in answer.text, (path, name)


def keep_picture(folder: Path) -> None:
    """As a build keeps one of an input that it refused."""
    file = rejected_picture_path(folder, "car")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"\x89PNG")


def test_every_answer_has_a_tag_and_is_sent_once(client: TestClient, folder: Path) -> None:
    keep_picture(folder)
    (folder / ".build" / "pictures" / "twin.png").write_bytes(b"\x89PNG")
    (folder / "stages").mkdir()
    (folder / "stages" / "a1.png").write_bytes(b"\x89PNG")
    for path in [call.path for call in CALLS]:
        plan = "twin" if path.endswith("picture.png") else "a1"
        ends = "?from=1,1&to=2,2" if path.endswith("way") else "?id=car" if "refused/" in path else ""
        asked = path.format(data="homes", plan=plan, name="train", form="sdf") + ends
        first = client.get(asked)
        again = client.get(asked, headers={"if-none-match": first.headers["etag"], "range": "bytes=0-3"})
        assert (first.status_code, again.status_code, again.content) == (200, 304, b""), asked
        assert again.headers["etag"] == first.headers["etag"]


def test_a_data_set_built_anew_is_opened_anew(client: TestClient, service: Service, folder: Path) -> None:
    shown = service.collections["homes"]
    built(folder, [*some_plans(), two_rooms("e5")])
    (folder / "manifest.json").write_text('{"plans": 5, "new": true}')
    shown._looked_s = 0.0
    shown.look()
    for _ in range(500):
        if len(shown.dataset) == 5:
            break
        time.sleep(0.02)
    assert client.get("/api/homes/plans").json()["found"] == 5
    assert client.get("/api/homes/plans/e5").status_code == 200


def test_a_plan_that_was_deleted_is_said_and_the_others_go_on(client: TestClient, folder: Path) -> None:
    (folder / "json" / "b2.json").unlink()
    gone = client.get("/api/homes/plans/b2")
    assert gone.status_code == 503
    assert gone.json()["error"].startswith("homes/json/b2.json: cannot be read")
    assert client.get("/api/homes/plans/b2/shape").status_code == 503
    assert client.get("/api/homes/plans/a1").status_code == 200


def test_a_data_set_that_is_being_built_stays_as_it_was(service: Service, folder: Path) -> None:
    shown = service.collections["homes"]
    (folder / ".build").mkdir()
    (folder / "manifest.json").unlink()
    shown._open_again("other")
    assert len(shown.dataset) == 4
