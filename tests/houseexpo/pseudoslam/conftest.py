"""The simulator's kernels are compiled once, where they are called."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from houseexpo.pseudoslam import step_kernels


@pytest.fixture(scope="session", autouse=True)
def _no_second_compiler() -> Iterator[None]:
    """Start no process that compiles a step: it would compile again what this one compiles for an episode's start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step_kernels, "count_cores", lambda: 1)
        yield
