"""A reviewer: what the page of a review sends to its service, and what the service answers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
from starlette.testclient import TestClient

from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.service import Service, ServiceSettings


class Reviewer:
    """Somebody at the page of a review."""

    def __init__(self, client: TestClient, data: str) -> None:
        self.client, self.base = client, f"/{data}/review"

    def look(self, plan: str) -> dict[str, Any]:
        """What the page shows of a plan."""
        answer = self.client.get(f"{self.base}/state", params={"plan": plan, "reviewer": "ann"})
        assert answer.status_code == 200, answer.text
        return dict(answer.json())

    def say(self, plan: str, action: str, **words: Any) -> dict[str, Any]:
        """Decide on a plan; return the answer, or the page's error."""
        asked = {"plan": plan, "action": action, "reviewer": "ann", "seen": self.look(plan)["seen"], **words}
        return dict(self.client.post(f"{self.base}/decide", json=asked).json())

    def build(self) -> dict[str, Any]:
        """Build again, and wait for its end."""
        confirm = self.client.get(f"{self.base}/build").json()["confirm"]
        answer = self.client.post(f"{self.base}/build", json={"reviewer": "ann", "confirm": confirm})
        assert answer.status_code == 200, answer.text
        for _ in range(1800):
            found: dict[str, Any] = self.client.get(f"{self.base}/build").json()
            if found["phase"] != "building":
                assert found["phase"] == "built", found["lines"]
                return found
            time.sleep(0.1)
        raise TimeoutError(found["lines"])


@contextmanager
def reviewing(folder: Path) -> Iterator[Reviewer]:
    """Serve a data set for review."""
    service = Service({folder.name: Collection(folder.name, folder)}, ServiceSettings(review=True))
    with TestClient(make_app(service), base_url="http://127.0.0.1") as client:
        assert client.get(f"/{folder.name}").status_code == 200  # the gallery
        assert client.get(f"/{folder.name}/review").status_code == 200
        yield Reviewer(client, folder.name)
