"""Vector environments of explorers in small houses."""

from __future__ import annotations

from typing import Any

from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from tests.builders.vectors import HUTS, native

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=32), max_steps=60)
GIVEN: dict[str, Any] = {"dataset": HUTS, "config": SMALL}


def explorers(number: int, mode: str = "NextStep", **given: Any) -> Any:
    return native("Exploration", number, mode, success_coverage=None, **{**GIVEN, **given})
