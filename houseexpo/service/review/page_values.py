"""What a reviewer is shown of a plan, as plain values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, Final

from houseexpo.drawing.scene import scene
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame, plan_from_source
from houseexpo.plan.explanations import GROUNDS
from houseexpo.service.review.changes import several
from houseexpo.service.review.decisions import Judged
from houseexpo.service.review.log import Line

SIZE_PX: Final = 900
_TELLING: Final = 0.005


def plan_values(plan: FloorPlan) -> dict[str, Any]:
    """Return a plan's measures and grounds, the weightiest first, and where its picture stands in its metres."""
    quality = plan.quality
    grounds = sorted((quality.grounds if quality else {}).items(), key=lambda pair: -pair[1])
    layout = scene(plan, None, SIZE_PX)
    frame = GridFrame.around(layout.bounds, layout.pixels_per_metre, margin_px=0, y_up=True)
    return {
        "plan": plan.id,
        "quality": quality.score if quality else None,
        "doubtful": bool(quality and quality.is_doubtful),
        "grounds": [[GROUNDS.get(name, name.replace("_", " ")), value] for name, value in grounds if value > _TELLING],
        "area": round(plan.area, 1),
        "rooms": plan.room_num,
        "doors": len(plan.doors),
        "drawable": plan.frame is not None,
        "picture": {"origin": frame.origin_m, "ppm": frame.pixels_per_metre, "size": frame.shape[::-1]},
    }


def marks(plan: FloorPlan, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the doors and points of no rooms of a plan's table (``Decisions.table``), in the plan's metres."""
    if plan.frame is None:
        return {"doors": [], "no_rooms": []}
    doors = [plan_from_source(plan.frame, door).tolist() for door in several(table.get("door"), "door")]
    points = [plan_from_source(plan.frame, point).tolist() for point in several(table.get("no_room"), "no_room")]
    return {"doors": doors, "no_rooms": points}


def history(latest: Line | None, judged: Judged | None) -> dict[str, Any]:
    """Return what was decided on a plan, by whom and when, and the number of the latest line about it."""
    last = judged.last if judged else None
    said = {"by": last.reviewer, "time": last.time, "actions": list(judged.actions)} if last and judged else None
    return {"judged": said, "seen": latest.number if latest else 0}


def summary(ids: Iterable[str], judged: Mapping[str, Judged]) -> dict[str, Any]:
    """Return what a review came to: the plans of each kind of decision, by whom, and from when to when."""
    there = {name: judged[name] for name in ids if name in judged}
    actions: dict[str, list[str]] = {}
    for name, found in there.items():
        for action in dict.fromkeys(found.actions):
            actions.setdefault(action, []).append(name)
    times = sorted(found.last.time for found in there.values())
    return {
        "actions": actions,
        "reviewers": dict(Counter(found.last.reviewer for found in there.values()).most_common()),
        "from": times[0] if times else None,
        "to": times[-1] if times else None,
    }
