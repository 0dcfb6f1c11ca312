"""Plans that the pipeline makes of houses that it makes."""

from __future__ import annotations

from pathlib import Path

from houseexpo import FloorPlan
from pipeline.rejection import Rejection
from pipeline.sources import suncg
from pipeline.sources.procedural import write_houses
from pipeline.values import Level
from tests.builders.shared import planned


def made_plans(folder: Path, houses: int, seed: int) -> list[FloorPlan]:
    """Write so many houses into a folder, and return the plans of those that give one."""
    write_houses(folder, houses, seed)
    plans = []
    for item in suncg.find(str(folder)):
        for level in suncg.read(item):
            if isinstance(level, Level):
                try:
                    plans.append(planned(level))
                except Rejection:
                    continue
    return plans
