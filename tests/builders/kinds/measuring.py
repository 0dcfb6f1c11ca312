"""A member of a kind against its truth: it meets the table if every storey does, and no storey was made up."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level
from tests.builders.kinds.registry import make_member
from tests.builders.kinds.values import Member
from tests.builders.shared import as_json, scorer


@dataclass(frozen=True)
class Row:
    """What a plan must hold: at least these shares, and at most so many cuts more than needed."""

    free_iou: float
    room_recall: float
    room_precision: float
    door_recall: float
    door_precision: float
    cuts_more: int


ROWS = {
    "solid": Row(0.97, 0.9, 0.75, 0.9, 0.75, 0),
    "sheet": Row(0.95, 0.9, 0.75, 0.9, 0.75, 0),
    "furnished": Row(0.92, 0.85, 0.7, 0.8, 0.7, 1),
    "scan": Row(0.90, 0.8, 0.7, 0.7, 0.6, 1),
    "ifc": Row(0.97, 0.9, 0.75, 1.0, 0.75, 0),
    "raw": Row(0.98, 1.0, 1.0, 1.0, 1.0, 0),
    "raw_sdf": Row(0.95, 1.0, 1.0, 1.0, 1.0, 0),
}
SAME_FLOOR_M = 0.6
"""How far a plan's floor may lie from the storey's that it is taken for."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a member: ``failing`` names the columns that do not hold ("free_iou", "no plan", "made up", ...)."""

    kind: str
    number: int
    failing: tuple[str, ...]
    seconds: float = 0.0
    qualities: tuple[tuple[float | None, bool], ...] = ()
    detail: str = ""
    scores: tuple[dict[str, Any], ...] = field(default=())

    @property
    def met(self) -> bool:
        """Whether all holds."""
        return not self.failing


def measure(kind: str, number: int, seed: int, folder: str, keep: str = "") -> Outcome:
    """Make a member, plan it, score it; with ``keep``, write file and plans there where it fails."""
    member = make_member(kind, number, seed, Path(folder))
    start = time.perf_counter()
    plans, errors = plans_of(member.path)
    seconds = time.perf_counter() - start
    scores, failing, spare = paired(member.truths, plans)
    detail = f"{member.about}; {'; '.join(errors)}"[:600]
    if spare:
        failing.append("made up")
    qualities = tuple((s.get("quality"), not s["failing"]) for s in scores)
    outcome = Outcome(kind, number, tuple(sorted(set(failing))), seconds, qualities, detail, tuple(scores))
    if keep and not outcome.met:
        keep_failure(member, plans, outcome, Path(keep))
    for file in member.path.parent.glob(f"{member.path.stem}.*"):
        file.unlink()
    return outcome


def plans_of(path: Path, change: Callable[[Level], Level] | None = None) -> tuple[list[dict[str, Any]], list[str]]:
    """All plans of a file as a reader of their JSON sees them, and why others were not made.

    ``change`` is done to each level before it is planned.
    """
    plans, errors = [], []
    try:
        for item in find(str(path)):
            for level in reader(item.reader).read(item):
                if not isinstance(level, Level):
                    errors.append(str(level.rejection))
                    continue
                try:
                    made = plan_level(change(level) if change else level, PipelineConfig(), np.random.default_rng(0))
                    plans += [as_json(plan) for plan in made if isinstance(plan, FloorPlan)]
                except Rejection as rejection:
                    errors.append(f"level at {level.frame.floor:.2f} m: {rejection}")
    except Rejection as rejection:
        errors.append(str(rejection))
    return plans, errors


def paired(
    truths: tuple[dict[str, Any], ...], plans: list[dict[str, Any]]
) -> tuple[list[dict[str, Any]], list[str], int]:
    """Each storey with the plan that fits it best; the columns that fail; how many plans fit no storey."""
    left, scores, failing = list(range(len(plans))), [], []
    options = sorted(((overlap(t, plans[k]), n, k) for n, t in enumerate(truths) for k in left), reverse=True)
    pairs: dict[int, int] = {}
    for share, n, k in options:
        if share > 0 and n not in pairs and k in left:
            pairs[n] = k
            left.remove(k)
    for n, truth in enumerate(truths):
        if n not in pairs:
            failing.append("no plan")
            scores.append({"failing": ["no plan"]})
            continue
        score = scorer()(plans[pairs[n]], truth)
        score["failing"] = columns_failing(score, truth)
        score["plan"] = pairs[n]
        score["quality"] = (plans[pairs[n]].get("quality") or {}).get("score")
        failing += score["failing"]
        scores.append(score)
    return scores, failing, len(left)


def overlap(truth: dict[str, Any], plan: dict[str, Any]) -> float:
    """Share of a storey's rooms that a plan on its floor covers; 0 on another floor."""
    if abs(plan["frame"]["floor"] - truth["floor_z"]) > SAME_FLOOR_M:
        return 0.0
    matrix = np.asarray(plan["frame"]["matrix"], float)
    found = shapely.Polygon(np.asarray(plan["verts"], float) @ matrix[:, :2].T + matrix[:, 2]).buffer(0)
    rooms = shapely.union_all([shapely.Polygon(r["polygon"]).buffer(0) for r in truth["rooms"]])
    return float(found.intersection(rooms).area / max(found.area, rooms.area))


def columns_failing(score: dict[str, Any], truth: dict[str, Any]) -> list[str]:
    """The columns of the table's row that do not hold, and what every plan must be: valid and in one piece."""
    row = ROWS[truth["kind"]]
    shares = ("free_iou", "room_recall", "room_precision", "door_recall", "door_precision")
    failing = [name for name in shares if score.get(name, 1.0) < getattr(row, name)]
    if score["cuts"] > score["cuts_needed"] + row.cuts_more:
        failing.append("cuts")
    if truth["kind"] == "ifc" and truth.get("labelled") and (score.get("label_accuracy") or 0.0) < 1.0:
        failing.append("labels")
    failing += [] if score["valid"] else ["valid"]
    return failing + ([] if score["components"] == 1 else ["components"])


def keep_failure(member: Member, plans: list[dict[str, Any]], outcome: Outcome, folder: Path) -> None:
    """Write what a person needs to see why a member fails."""
    folder.mkdir(parents=True, exist_ok=True)
    stem = member.path.stem
    for file in member.path.parent.glob(f"{stem}.*"):
        (folder / file.name).write_bytes(file.read_bytes())
    record = {"failing": outcome.failing, "detail": outcome.detail, "scores": outcome.scores, "truths": member.truths}
    (folder / f"{stem}.truth.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
    for number, plan in enumerate(plans):
        (folder / f"{stem}.plan{number}.json").write_text(json.dumps(plan), encoding="utf-8")
