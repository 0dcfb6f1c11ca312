"""Real houses with known truth, where the folder ``shared`` stands beside the project."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import shapely
import shapely.affinity

from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_largest_building, plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import ifc, mesh_file
from pipeline.values import Level

SHARED = Path(__file__).resolve().parents[3] / "shared"
DATA = SHARED / "data"
CASES = sorted(path.stem for path in (DATA / "cases").glob("*.json"))
NOT_YET = {
    "mamm3d_office": "a phone's scan, open on one side: its rooms come out wrong",
    "ubiquiti_floorplan": "a scan of which no level becomes a plan",
}
"""Cases that give no sound plan yet, and why: expected to fail, and to be moved from here as soon as they do not."""

needs_shared = pytest.mark.skipif(not DATA.is_dir(), reason="needs the development data in ../shared")


def case(name: str) -> dict[str, Any]:
    """The truth of a case."""
    return dict(msgspec.json.decode((DATA / "cases" / f"{name}.json").read_bytes()))


def of_building(truth: dict[str, Any], plan: dict[str, Any]) -> dict[str, Any]:
    """The rooms and doors of a truth that lie in or on a plan (as JSON) of one of several buildings."""
    (a, b, tx), (c, d, ty) = plan["frame"]["matrix"]
    outline = shapely.Polygon(plan["verts"], plan.get("holes", []))
    place = shapely.affinity.affine_transform(outline, [a, b, c, d, tx, ty]).buffer(0.5)
    index = [k for k, room in enumerate(truth["rooms"]) if place.contains(shapely.Polygon(room["polygon"]).centroid)]
    new = {old: k for k, old in enumerate(index)}
    zones = truth.get("zones") and [[new[k] for k in zone] for zone in truth["zones"] if set(zone) <= set(index)]
    doors = [door for door in truth["doors"] if place.contains(shapely.Point(door["centre"]))]
    return {**truth, "rooms": [truth["rooms"][k] for k in index], "zones": zones, "doors": doors}


WIDEST_DOOR_M = 2.5
"""The truths list no opening that is wider: they were drawn when such a gap was no boundary."""


def scorer() -> Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]]:
    """``score(plan, case)`` of the tool beside the data, without openings that are too wide for its truths."""
    spec = importlib.util.spec_from_file_location("score_plan", SHARED / "tools" / "score_plan.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda plan, truth: module.score(_without_wide_openings(plan), truth)


def _without_wide_openings(plan: dict[str, Any]) -> dict[str, Any]:
    """Return a plan in which wide openings are of a kind that the tool does not count as doors."""
    wide = [d for d in plan.get("doors", []) if d["kind"] == "opening" and d["width"] > WIDEST_DOOR_M]
    kept = [door for door in plan.get("doors", []) if door not in wide]
    return plan if not wide else {**plan, "doors": [*kept, *({**door, "kind": "wide"} for door in wide)]}


def levels(path: Path) -> Iterator[Level]:
    """All levels of a mesh or an IFC file, read with the defaults."""
    reader = ifc if path.suffix == ".ifc" else mesh_file
    for item in reader.find(str(path)):
        for level in reader.read(item):
            if not isinstance(level, Level):
                raise level.rejection
            yield level


def plan_nearest(path: Path, floor_z: float) -> FloorPlan:
    """The (largest) plan whose floor lies nearest to ``floor_z``; levels that are rejected are passed over."""
    return max(plans_nearest(path, floor_z), key=lambda plan: plan.area)


def plans_nearest(path: Path, floor_z: float) -> list[FloorPlan]:
    """The plans of the level whose floor lies nearest to ``floor_z``, one a building.

    LookupError where no level becomes a plan.
    """
    found: list[tuple[tuple[float, int], list[FloorPlan]]] = []
    for level in levels(path):
        try:
            made = plan_level(level, PipelineConfig(), np.random.default_rng(0))
        except Rejection:
            continue
        plans = [plan for plan in made if isinstance(plan, FloorPlan)]
        found.append(((abs(level.frame.floor - floor_z), level.frame.level), plans))
    if not found:
        raise LookupError(f"{path.name}: no level became a plan")
    return min(found, key=lambda each: each[0])[1]


def planned(level: Level, config: PipelineConfig | None = None) -> FloorPlan:
    """The plan of a level, with all defaults where no configuration is given."""
    return plan_largest_building(level, config or PipelineConfig(), np.random.default_rng(0))


def as_json(plan: FloorPlan) -> dict[str, Any]:
    """The plan as a reader of its file would see it."""
    return dict(msgspec.json.decode(encode(plan)))
