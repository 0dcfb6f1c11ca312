"""The disk is full while it serves: everything can be looked at, and a decision that finds no room says so."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
from starlette.testclient import TestClient

from houseexpo.service.app import make_app
from tests.builders.clusters import disks
from tests.builders.services import BASE, judged_later, service_of

PAGES = ("", "plan/doubtful", "refused", "statistics", "review", "review/state?reviewer=ann")
ASKED = ("plans", "plans/doubtful", "plans/doubtful/thumbnail.svg", "plans/doubtful/export/ros", "facets")


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A small disk that holds the data set, the cache and the temporary folder."""
    with disks() as mount:
        place = mount("disk", "400k")
        monkeypatch.setenv("HOUSEEXPO_CACHE", str(place / "cache"))
        monkeypatch.setenv("TMPDIR", str(place))
        yield place


def fill(disk: Path) -> Path:
    """Leave no byte."""
    file = disk / "filler"
    with file.open("wb", buffering=0) as stream:
        for size in (4096, 1):
            try:
                while stream.write(bytes(size)) == size:
                    pass
            except OSError:
                continue
    return file


def decide(client: TestClient, plan: str, action: str) -> Any:
    return client.post("/houses/review/decide", json={"plan": plan, "action": action, "reviewer": "ann"})


def test_it_serves_on_and_nothing_that_was_answered_is_lost(disk: Path) -> None:
    folder = judged_later(disk / "houses", {"doubtful": 0.4, "middling": 0.7, "sure": 0.95})
    client = TestClient(make_app(service_of(folder, review=True)), base_url=BASE, raise_server_exceptions=False)
    assert decide(client, "doubtful", "drop").status_code == 200
    filler = fill(disk)
    for path in [f"/houses/{page}" for page in PAGES] + [f"/api/houses/{asked}" for asked in ASKED]:
        assert client.get(path).status_code == 200, path
    refused = decide(client, "sure", "keep")
    assert refused.status_code in {400, 507}, refused.text
    assert "No space left on device" in refused.text
    assert tomllib.loads((folder / "overrides.toml").read_text()) == {"doubtful": {"drop": True}}
    filler.unlink()
    assert decide(client, "sure", "keep").status_code == 200
    assert tomllib.loads((folder / "overrides.toml").read_text())["sure"] == {"keep": True}
