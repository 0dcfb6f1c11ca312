"""What programs and people ask in other words than expected: lists in parts, addresses with a slash more, furniture."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.testclient import TestClient

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject, Room
from houseexpo.service.app import make_app
from houseexpo.service.plan_page import _provenance
from tests.builders.services import BASE, box, built, service_of


def test_a_list_may_come_in_several_parameters(client: TestClient) -> None:
    together = client.get("/api/homes/plans?labels=Kitchen,Bedroom").json()
    assert client.get("/api/homes/plans", params={"labels": ["Kitchen", "Bedroom"]}).json() == together
    assert together["found"] == 2
    assert client.get("/api/homes/plans?text=kitchen&text=a1").json()["found"] == 1


@pytest.mark.parametrize("query", ["rooms=2&rooms=5", "sort=area&sort=rooms", "limit=1&limit=2"])
def test_what_can_be_meant_once_is_refused_twice(client: TestClient, query: str) -> None:
    answer = client.get(f"/api/homes/plans?{query}")
    assert answer.status_code == 400
    assert "expected once, found 2" in answer.json()["error"]


def test_a_slash_more_leads_to_the_same_page(client: TestClient) -> None:
    assert client.get("/api/").url.path == "/api"


def test_review_that_was_not_asked_for_says_so(client: TestClient) -> None:
    answer = client.get("/homes/review", headers={"accept": "text/html"})
    assert answer.status_code == 404
    assert "--review" in answer.text


def test_furniture_at_a_wall_leaves_the_wall_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    outline = [(0.1, 0.1), (0.1, 3.1), (4.1, 3.1), (4.1, 2.1), (3.1, 2.1), (3.1, 1.1), (4.1, 1.1), (4.1, 0.1)]
    sofa = PlanObject(0, "sofa", 0, box(3.1, 1.1, 4.1, 2.1), 0.8)
    plan = FloorPlan("flat", outline, 1, {}, rooms=(Room(0, "Living_Room", outline),), objects=(sofa,))
    client = TestClient(make_app(service_of(built(tmp_path / "flats", [plan]))), base_url=BASE)
    outside, inside = client.get("/api/flats/plans/flat/shape").json()["walls"]
    assert sorted(map(tuple, inside)) == sorted(box(0.1, 0.1, 4.1, 3.1))
    assert len(outside) == 4


def test_provenance_is_told_in_words() -> None:
    told = {"heights": {"ground": 0.01, "door": 0.2}, "notes": {}, "cuts_at": [1, 2], "file": "a.glb"}
    plan = FloorPlan("hut", box(0.1, 0.1, 4.1, 3.1), 1, {}, provenance=told)
    assert dict(_provenance(plan)) == {"heights": "ground: 0.01, door: 0.2", "cuts at": "1, 2", "file": "a.glb"}


@pytest.mark.parametrize("path", ["/homes/plan/a1", "/api"])
def test_lines_to_copy_say_where_the_token_goes(folder: Path, path: str) -> None:
    client = TestClient(make_app(service_of(folder, token="secret")), base_url=BASE)  # noqa: S106  # a test's
    text = client.get(path, headers={"authorization": "Bearer secret"}).text
    assert "/homes?token=TOKEN" in text
    assert "secret" not in text


def test_there_is_no_other_subset() -> None:
    from houseexpo.dataset.fetch import fetch

    for subset in (37, "most"):
        with pytest.raises(ConfigError, match="expected one of 10, 100, 1000, all"):
            fetch(subset)  # type: ignore[arg-type]  # what somebody may write
