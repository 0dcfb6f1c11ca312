"""What programs and people ask in other words than expected: lists in parts, addresses with a slash more, furniture."""

from __future__ import annotations

from pathlib import Path

import pytest
from shapely import Polygon
from starlette.testclient import TestClient

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import PlanObject, Room
from houseexpo.service.app import make_app
from tests.builders.services import BASE, box, built, service_of


def test_a_list_may_come_in_several_parameters(client: TestClient) -> None:
    together = client.get("/api/homes/plans?labels=Kitchen,Bedroom").json()
    assert client.get("/api/homes/plans", params={"labels": ["Kitchen", "Bedroom"]}).json() == together
    assert together["found"] == 2
    assert client.get("/api/homes/plans?text=kitchen&text=a1").json()["found"] == 1


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
    assert Polygon(inside).equals(Polygon(box(0.1, 0.1, 4.1, 3.1)))
    assert len(outside) == 4


@pytest.mark.parametrize("path", ["/homes/plan/a1", "/api"])
def test_lines_to_copy_say_where_the_token_goes(folder: Path, path: str) -> None:
    client = TestClient(make_app(service_of(folder, token="secret")), base_url=BASE)  # noqa: S106  # a test's
    text = client.get(path, headers={"authorization": "Bearer secret"}).text
    assert "/homes?token=TOKEN" in text
    assert "secret" not in text
