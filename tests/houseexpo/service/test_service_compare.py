"""Two plans side by side."""

from __future__ import annotations

import pytest

pytest.importorskip("starlette")

from starlette.testclient import TestClient


def test_two_plans_stand_side_by_side_with_what_differs(client: TestClient) -> None:
    page = client.get("/homes/compare?plans=a1,b2").text
    assert "2 rooms, 21 m²" in page
    assert "2 rooms, 24 m²" in page
    assert "+3.00 m²" in page  # a kitchen of 4 x 3 m, a garage of 5 x 3 m
    assert "Garage" in page
    assert "of the larger free space differs" in page


def test_a_plan_is_the_same_as_itself(client: TestClient) -> None:
    page = client.get("/homes/compare?plans=a1,a1").text
    assert "The free spaces are equal" in page


def test_a_plan_of_another_data_set_stands_beside_one(client: TestClient) -> None:
    page = client.get(f"/homes/compare?plans=d%204%26%C3%A9,{3:032x}&other=published").text
    assert f'/published/plan/{3:032x}"' in page
    assert "d 4&amp;é" in page


@pytest.mark.parametrize(
    ("query", "status"),
    [
        ("plans=a1", 400),
        ("plans=a1,b2,c3", 400),
        ("", 400),
        ("plans=a1,nobody", 404),
        ("plans=a1,<script>alert(1)</script>", 404),
        ("plans=a1,b2&other=elsewhere", 400),
    ],
)
def test_what_cannot_be_compared_is_said(client: TestClient, query: str, status: int) -> None:
    answer = client.get(f"/homes/compare?{query}", headers={"accept": "text/html"})
    assert answer.status_code == status
    assert "<script>alert" not in answer.text
