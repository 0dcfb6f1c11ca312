"""The map by likeness: the same each time, like plans near each other, and nothing breaks on few plans."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette")

from starlette.testclient import TestClient

from houseexpo.service import similarity_map
from houseexpo.service.collection import Collection
from houseexpo.service.similarity_map import SimilarityMap, lay_out_by_similarity


def clusters(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    kind = rng.integers(0, 3, count)
    return rng.normal(0.0, 0.4, (count, 12)) + 4.0 * np.eye(12)[kind], kind


def test_like_plans_lie_near_each_other() -> None:
    features, kind = clusters(240)
    places = lay_out_by_similarity(features)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    assert (kind[apart.argmin(axis=1)] == kind).mean() > 0.97
    assert 0.0 <= places.min() <= places.max() <= 1.0


def test_a_plan_unlike_all_others_does_not_squeeze_them_together() -> None:
    features, _ = clusters(30)
    features[0] *= 40.0
    places = lay_out_by_similarity(features)
    middle = np.quantile(places[1:], 0.9, axis=0) - np.quantile(places[1:], 0.1, axis=0)
    assert (middle > 0.3).all()


def test_a_data_set_gives_the_same_map_each_time() -> None:
    features, _ = clusters(100)
    assert lay_out_by_similarity(features).tobytes() == lay_out_by_similarity(features).tobytes()


@pytest.mark.parametrize("count", [0, 1, 2, 3, 5])
def test_few_or_equal_plans_have_places(count: int) -> None:
    places = lay_out_by_similarity(np.ones((count, 4)))
    assert places.shape == (count, 2)
    assert np.isfinite(places).all()


def test_the_map_knows_what_meets_the_filter(client: TestClient) -> None:
    found = client.get("/api/homes/map").json()
    assert len(found["x"]) == len(found["y"]) == len(found["ids"]) == 4
    assert found["found"] is None
    some = client.get("/api/homes/map?labels=Garage").json()
    assert [some["ids"][row] for row in some["found"]] == ["b2"]
    assert client.get("/homes/map").status_code == 200
    assert client.get("/homes/map?labels=Nonsense").status_code == 400
    assert client.get("/api/published/map").status_code == 200


def test_a_large_map_is_seen_before_it_is_made_and_is_kept(
    client: TestClient, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(similarity_map, "_LARGE", 0)
    table = Collection("homes", folder).now.views.table
    drawn = SimilarityMap(table)
    places, is_final = drawn.positions()
    assert places.shape == (len(table), 2)
    assert not is_final
    end = time.monotonic() + 60
    while not drawn.positions()[1] and time.monotonic() < end:
        time.sleep(0.01)
    expected = lay_out_by_similarity(similarity_map.plan_features(table))
    assert drawn.positions()[0].tobytes() == expected.tobytes()
    [kept] = (tmp_path / "cache" / "maps").rglob("*.npy")
    monkeypatch.setattr(similarity_map, "lay_out_by_similarity", None)
    again, is_final = SimilarityMap(table).positions()
    assert is_final
    assert again.tobytes() == expected.tobytes()
    monkeypatch.undo()
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    kept.write_bytes(kept.read_bytes()[:60])
    assert SimilarityMap(table).positions()[0].tobytes() == expected.tobytes()


def test_a_page_is_told_whether_the_map_is_made(client: TestClient) -> None:
    assert client.get("/api/homes/map").json()["final"] is True
