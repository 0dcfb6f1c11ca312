"""A data set of three huts with a cache of its own, and which worlds were made, not read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from houseexpo.pseudoslam.worlds import cache as cache_module
from houseexpo.pseudoslam.worlds.world import World
from tests.builders.simulations import write_huts


@pytest.fixture
def plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set of three huts, and a cache of its own."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    return write_huts(tmp_path)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The plans of which worlds were made, not read."""
    ids: list[str] = []
    true = cache_module.make_world

    def watched(plan: Any, *rest: Any) -> World:
        ids.append(plan.id)
        return true(plan, *rest)

    monkeypatch.setattr(cache_module, "make_world", watched)
    return ids
