"""A quick planner whose plans are as sure as the names of their houses say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Quality
from pipeline.config import PipelineConfig
from pipeline.values import Level
from tests.builders.batch import boxed


def doubting(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan]:
    """Return the room of a ``one_room`` house; ``sure_30`` is 0.30 sure, half of its doors being cuts."""
    (plan,) = boxed(level, config, rng)
    _, said, hundredths = plan.id.partition("sure_")
    return (replace(plan, quality=Quality(int(hundredths) / 100, {"cut_share": 0.5})) if said else plan,)
