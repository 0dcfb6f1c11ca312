"""Plan a level and draw its stages as one PNG beside each plan, for builds that keep pictures (``--keep-stages``).

The plans are those of ``make_plans``. How pictures are drawn shows in no plan, so ``job`` does not know this module:
no plan is made again because pictures are drawn otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from houseexpo.floorplan import FloorPlan
from pipeline.batch.job import PlanWithPicture
from pipeline.config import PipelineConfig
from pipeline.timing import time_stages
from pipeline.values import Level, RejectedLevel

if TYPE_CHECKING:
    from pipeline.algorithm import StageResult


def make_plans_with_pictures(
    level: Level, config: PipelineConfig, rng: np.random.Generator
) -> Sequence[PlanWithPicture | RejectedLevel]:
    """Plan a level as ``make_plans`` does; each plan comes with the sheet that ``houseexpo inspect`` draws of it."""
    from pipeline.algorithm import run_stages

    seen = list(time_stages(run_stages(level, config, rng), attrgetter("stage")))
    return list(time_stages(_outcomes(seen, level), lambda _: "pictures"))


def _outcomes(seen: Sequence[StageResult], level: Level) -> Iterator[PlanWithPicture | RejectedLevel]:
    from pipeline.pictures import compose_sheet, results_of_building

    for result in seen:
        if isinstance(result.value, RejectedLevel):
            yield result.value
        elif isinstance(result.value, FloorPlan):
            own = results_of_building(seen, level.id, result.id)
            yield PlanWithPicture(result.value, compose_sheet(own, level.frame))
