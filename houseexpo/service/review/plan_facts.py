"""Tell the page Review what it shows of a plan: its measures, its corrections, and the decisions on it."""

from __future__ import annotations

from typing import Any, Final

from houseexpo.corrections import Correction
from houseexpo.corrections.preview import Preview
from houseexpo.corrections.vocabulary import checked_values
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import plan_points_from_source
from houseexpo.plan.explanations import GROUNDS
from houseexpo.service.api.analysis import shape_values
from houseexpo.service.plan_page import room_names_beside
from houseexpo.service.review.decisions import DecisionStore, PlanDecisions
from houseexpo.service.review.requests import MILLIMETRE_DIGITS
from houseexpo.service.review.sources import SourceView
from houseexpo.service.search import plan_title

_PARTS: Final = ("space", "walls", "open", "boxes", "objects", "stairs", "rooms", "doors", "windows", "words")
"""All that is drawn of a plan (``shape_values``)."""


def facts_without_plan(name: str, source: SourceView | None) -> dict[str, Any]:
    """Return the state of the page for a house without a plan: an empty plan at the place of its source."""
    bounds = list(source.pictured) if source is not None else None
    shape = {
        "id": name,
        "bounds": bounds,
        **{part: [] for part in _PARTS},
    }
    return {
        "plan": name, "title": "Rejected", "quality": None, "doubtful": False, "grounds": [], "unsure": [], "area": 0.0,
        "rooms": 0, "doors": 0, "drawable": source is not None, "frame": source.level.frame.matrix if source else None,
        "shape": shape if bounds else None, "effects": [], "questions": [],
    }  # fmt: skip


_STEPS: Final = 60
"""The latest decisions on a plan that the page lists."""
_LEAST_GROUND: Final = 0.005
"""Smaller grounds are not shown: they round to 0.00."""


def plan_facts(plan: FloorPlan) -> dict[str, Any]:
    """Return a plan's measures, its grounds (the strongest first), and its shape in metres."""
    quality = plan.quality
    grounds = sorted((quality.grounds if quality else {}).items(), key=lambda pair: -pair[1])
    return {
        "plan": plan.id,
        "title": plan_title(len(plan.rooms) or None, plan.area, plan.room_num),
        "quality": quality.score if quality else None,
        "doubtful": bool(quality and quality.is_doubtful),
        "grounds": [
            [GROUNDS.get(name, name.replace("_", " ")), value] for name, value in grounds if value > _LEAST_GROUND
        ],
        "unsure": unsure_parts(plan),
        "area": round(plan.area, 1),
        "rooms": len(plan.rooms),
        "doors": len(plan.doors),
        "drawable": plan.frame is not None,
        "frame": plan.frame.matrix if plan.frame else None,
        "shape": shape_values(plan),
    }


def unsure_parts(plan: FloorPlan) -> list[str]:
    """Return the rooms and doors that are more likely wrong than right, in words, the least certain first."""
    rooms = [
        (room.confidence, f"outline of room {room.id}, {room.label.replace('_', ' ')}")
        for room in plan.rooms
        if room.is_unsure
    ]
    doors = [
        (door.confidence, f"{door.kind} {door.id}, between {room_names_beside(plan, door)}")
        for door in plan.doors
        if door.is_unsure
    ]
    return [f"{text}: {confidence:.0%} sure" for confidence, text in sorted(rooms + doors)]


def said_corrections(plan: FloorPlan, told: Preview[FloorPlan]) -> list[dict[str, Any]]:
    """Return the record of each correction of a plan, and its points in metres of the plan."""
    frame = plan.frame
    if frame is None:
        return []
    found = []
    for record in told.records:
        points = Correction(record["word"], checked_values(record["word"], [record["value"]])[0]).points
        found.append({**record, "points": plan_points_from_source(frame, points).round(MILLIMETRE_DIGITS).tolist()})
    return found


def decision_history(name: str, storey: str, decisions: DecisionStore, judged: PlanDecisions | None) -> dict[str, Any]:
    """Return the decisions on a plan, with reviewer and time, and the number of the latest log line about it.

    ``storey`` is the id of its whole storey, "" if it is one.
    """
    last, latest = judged.last if judged else None, decisions.latest()
    lines = [latest[each].number for each in (name, storey) if each in latest]
    said = {"by": last.reviewer, "time": last.time, "actions": list(judged.actions)} if last and judged else None
    steps = [
        {
            "number": line.number,
            "action": line.action,
            "keys": sorted(line.changes),
            "by": line.reviewer,
            "time": line.time,
            "holds": holds,
            "answer": line.answer,
        }
        for line, holds in decisions.history(name, storey)
    ]
    return {"judged": said, "seen": max(lines, default=0), "history": steps[-_STEPS:]}
