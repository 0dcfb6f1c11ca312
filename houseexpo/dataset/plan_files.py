"""Files with one plan: read them, and write them atomically."""

from __future__ import annotations

import os
from pathlib import Path

from houseexpo.errors import PlanError
from houseexpo.floorplan import FloorPlan, decode


def load_plan(path: str | os.PathLike[str]) -> FloorPlan:
    """Read a plan from a JSON file.

    Raises
    ------
    PlanError
        The file does not contain a valid plan; the error names the file.
    """
    file = Path(path)
    try:
        return decode(file.read_bytes())
    except PlanError as error:
        raise PlanError(error.problem, f"{file}: {error.key}" if error.key else str(file), error.plan) from None


def save_plan(plan: FloorPlan, path: str | os.PathLike[str]) -> None:
    """Write a plan to a JSON file, like ``plan.save(path)``."""
    plan.save(path)
