"""Algorithm 1 of the paper on one page: the stages in its order, one house in, a plan or a rejection out."""

from __future__ import annotations

import numpy as np

from houseexpo.plan import FloorPlan
from pipeline.config import PipelineConfig
from pipeline.values import Level


def plan_house(level: Level, config: PipelineConfig, rng: np.random.Generator) -> FloorPlan:
    """Turn one level into its floor plan; raises Rejection where it cannot become one."""
    raise NotImplementedError
