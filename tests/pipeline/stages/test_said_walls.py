"""The plan that a person draws of a level in which the search finds none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from houseexpo.corrections import Correction
from pipeline.algorithm import plan_largest_building
from pipeline.config import PipelineConfig
from pipeline.geometry.prisms import Prisms
from tests.builders.houses import level

OUTLINE = Correction("room_outline", ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)))
GRID = Correction("no_wall", ((4.1, -2.0), (4.1, 9.0)))


def doors_of(*said: Correction) -> tuple[list[str], list[str]]:
    """The kinds of doors of a drawing without walls, and the outcomes of what is said of it."""
    drawing = replace(level(Prisms([])), corrections=said)
    plan = plan_largest_building(drawing, PipelineConfig(), np.random.default_rng(0))
    return [door.kind for door in plan.doors], [each["outcome"] for each in (plan.provenance or {})["corrections"]]


def test_a_line_that_was_no_wall_opens_no_first_room_that_is_drawn_on_it() -> None:
    beside = Correction("no_wall", ((-0.9, -2.0), (-0.9, 9.0)))
    assert doors_of(GRID, beside, OUTLINE) == ([], ["done", "none", "none"])
    assert doors_of(GRID, OUTLINE) == ([], ["done", "none"])
    assert doors_of(OUTLINE, GRID) == (["entrance"], ["done", "done"])
