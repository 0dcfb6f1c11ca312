"""Why a plan is as it is, as far as its file says so: its quality, what the build did, and what each door rests on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Quality
from houseexpo.plan.explanations import DOORS, GROUNDS, NOTES
from houseexpo.plan.parts import SURE


class Reason(NamedTuple):
    """A door: its number, its kind, the rooms at its sides, and why it is there."""

    number: int
    kind: str
    between: str
    why: str


class Evidence(NamedTuple):
    """What the file says, in words: ``grounds`` are those that speak against the plan, the strongest first."""

    quality: str
    grounds: list[tuple[str, float]]
    notes: list[str]
    doors: list[Reason]

    def __bool__(self) -> bool:
        """Whether anything is said."""
        return any(self)


def evidence_of(plan: FloorPlan) -> Evidence:
    """Return what a plan's file says of how it came about; a provenance that says it in no known form says nothing."""
    told = plan.provenance or {}
    grounds = {} if plan.quality is None else plan.quality.grounds
    against = sorted(((GROUNDS.get(name, _spaced(name)), value) for name, value in grounds.items() if value > 0))
    return Evidence(
        "" if plan.quality is None else _said(plan.quality),
        sorted(against, key=lambda pair: -pair[1]),
        list(_notes(told.get("notes"))),
        [_reason(plan, door, _cuts(told.get("cuts"))) for door in plan.doors],
    )


def _said(quality: Quality) -> str:
    how = f"doubtful: below {SURE:g}" if quality.is_doubtful else f"sure: {SURE:g} or more"
    others = sum(value <= 0 for value in quality.grounds.values())
    return f"Quality {quality.score:.2f}, {how}." + (f" {others} grounds say nothing against it." if others else "")


def _notes(notes: Any) -> Iterator[str]:
    if isinstance(notes, Mapping):
        for name, value in notes.items():
            key = f"{name}:{value}" if isinstance(value, str) else str(name)
            times = f" ({value})" if isinstance(value, int) else ""
            yield NOTES.get(key, _spaced(key)) + times


def _cuts(cuts: Any) -> dict[Any, str]:
    """Return what speaks for the place of each cut, by the door's number."""
    found = [cut for cut in cuts if isinstance(cut, Mapping)] if isinstance(cuts, list | tuple) else []
    return {cut.get("door"): str(cut["why"]) for cut in found if cut.get("why")}


def _reason(plan: FloorPlan, door: Door, cuts: Mapping[Any, str]) -> Reason:
    labels = {room.id: room.label for room in plan.rooms}
    sides = [_spaced(labels.get(room, "room")) if room is not None else "outside" for room in door.rooms]
    place = cuts.get(door.id, "") if door.kind == "cut" else ""
    return Reason(door.id, door.kind, " and ".join(sides), DOORS[door.kind] + (f"; cut here: {place}" if place else ""))


def _spaced(name: str) -> str:
    return name.replace("_", " ")
