"""A service of two small data sets, and a client of it."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("starlette")

from starlette.testclient import TestClient

from houseexpo.service.app import make_app
from houseexpo.service.service import Service
from tests.builders.services import BASE, built, published, service_of, some_plans


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder as a build leaves it: four plans, three inputs refused, one duplicate dropped."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    return built(tmp_path / "homes", some_plans(), ("a1", "c3"))


@pytest.fixture
def service(folder: Path, tmp_path: Path) -> Service:
    return service_of(folder, published(tmp_path / "published.jsonl", 12))


@pytest.fixture
def client(service: Service) -> TestClient:
    return TestClient(make_app(service), base_url=BASE, raise_server_exceptions=False)
