"""Algorithm 1 of the paper on one page: the stages in its order, one house in, a plan or a rejection out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from houseexpo.graph import navigability
from houseexpo.plan import FloorPlan
from pipeline.config import PipelineConfig
from pipeline.quality import judged
from pipeline.rejection import Reason, Rejection
from pipeline.stages.cells import fill_cells
from pipeline.stages.connectivity import connect
from pipeline.stages.contour import trace_contour
from pipeline.stages.doors import find_doors
from pipeline.stages.evidence import gather
from pipeline.stages.grounds import weigh
from pipeline.stages.isolated import erase_isolated
from pipeline.stages.layout import lay_out
from pipeline.stages.planes import cut_planes
from pipeline.stages.refine import refine
from pipeline.stages.rooms import name_rooms
from pipeline.stages.vectorise import vectorise
from pipeline.values import Evidence, Layout, Level, Planes, Spaces


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What a stage made, for pictures; ``value`` is an Evidence, a Planes, a Layout, a Spaces or the FloorPlan."""

    stage: str
    value: Evidence | Planes | Layout | Spaces | FloorPlan


def stages(level: Level, config: PipelineConfig, rng: np.random.Generator) -> Iterator[Snapshot]:
    """Run Algorithm 1 and show each step; raises Rejection where the house cannot become a plan."""
    evidence = gather(level, config.evidence)
    yield Snapshot("evidence", evidence)
    planes = cut_planes(level, evidence, config.planes)
    yield Snapshot("planes", planes)
    layout = lay_out(level, evidence, planes, config.layout)
    yield Snapshot("layout", layout)
    spaces = find_doors(level, planes, layout, config.doors)
    yield Snapshot("doors", spaces)
    spaces = trace_contour(spaces)
    yield Snapshot("contour", spaces)
    spaces = fill_cells(spaces, config.cells)
    yield Snapshot("cells", spaces)
    spaces = erase_isolated(spaces, config.isolated)
    yield Snapshot("isolated", spaces)
    spaces = connect(spaces, config.connectivity, config.cells.area_m2, rng)
    yield Snapshot("connectivity", spaces)
    spaces = refine(spaces, config.refine)
    yield Snapshot("refine", spaces)
    plan = vectorise(level, spaces, name_rooms(level, spaces), _provenance(level, planes, spaces))
    quality = judged(weigh(level, evidence, layout, spaces))
    yield Snapshot("plan", replace(plan, navigability=navigability(plan), quality=quality))


def plan_house(level: Level, config: PipelineConfig, rng: np.random.Generator) -> FloorPlan:
    """Turn one level into its floor plan; raises Rejection where it cannot become one."""
    for snapshot in stages(level, config, rng):
        if isinstance(snapshot.value, FloorPlan):
            return snapshot.value
    raise Rejection("algorithm", Reason.INTERNAL, "no stage made a plan")


def _provenance(level: Level, planes: Planes, spaces: Spaces) -> dict[str, Any]:
    heights = {k: np.round(v, 4).tolist() for k, v in planes.heights.items()}
    return {**level.provenance, "heights": heights, "notes": dict(sorted(spaces.notes.items()))}
