"""What learning needs."""

from __future__ import annotations

import pytest

from tests.builders.needs import need


@pytest.fixture
def learn() -> None:
    """Skip where the extra ``learn`` is not installed; in CI, fail."""
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard"], how="make learn")
