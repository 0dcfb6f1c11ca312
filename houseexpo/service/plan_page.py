"""Serve the page of a plan: measures, previous and next plan, provenance, evidence for its quality and its doors.

The page itself draws and measures the plan; ``/api`` computes what takes longer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple
from urllib.parse import quote

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing.styles import DOOR_COLOURS
from houseexpo.exports import FORMATS
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Quality
from houseexpo.plan.explanations import DOORS, GROUNDS, NOTES
from houseexpo.plan.parts import SURE
from houseexpo.plan.room_labels import label_colour
from houseexpo.service.collection import OpenedDataset
from houseexpo.service.search import MEASURES, RADII, Rows, parse_query
from houseexpo.service.service import Service
from houseexpo.words import count_noun


def routes(service: Service) -> list[BaseRoute]:
    """Return the route of ``/DATA/plan/ID``."""

    def plan(request: Request) -> Response:
        shown = service.collection(request)
        query, name = parse_query(request.query_params), request.path_params["plan"]
        now, view = shown.find(query)
        found = now.plan(name)
        before, place, after, number = _neighbours(now, name, view.rows, request.url.query)
        return service.page(
            request,
            "plan.html",
            shown=shown,
            here="plan",
            plan=found,
            quoted=quote(name, safe=""),
            title=now.views.table.title(now.numbers[name]),
            legend=_legend(found),
            query=request.url.query,
            before=before,
            after=after,
            place=place,
            found=number,
            measures=list(_measures(now, name)),
            evidence=plan_evidence(found),
            has_stages=now.data.stages(name) is not None,
            provenance=list(_provenance(found)),
            splits=[each for each, ids in now.data.splits.items() if name in ids],
            repeats=now.records.repeats_of(name),
            formats=FORMATS,
            python=_python(service.opening(request, shown.name), name),
        )

    return [Route("/{data}/plan/{plan}", plan)]


def _legend(plan: FloorPlan) -> list[tuple[str, str]]:
    """Return the labels in the drawing, the most frequent first, and the kinds of doors, with their colours."""
    rooms = Counter(room.label for room in plan.rooms) if plan.rooms else Counter(plan.room_category)
    labels = [(label.replace("_", " "), label_colour(label)) for label, _ in rooms.most_common()]
    kinds = dict.fromkeys(door.kind for door in plan.doors)
    return [*labels, *((kind, DOOR_COLOURS[kind]) for kind in kinds)]


def _neighbours(now: OpenedDataset, name: str, rows: Rows, query: str) -> tuple[str | None, int, str | None, int]:
    """Return the plan before, the position (from 1; 0 if the view lacks the plan), the plan after, and the number."""
    at = (rows == now.numbers[name]).nonzero()[0]
    if not len(at):
        return None, 0, None, len(rows)
    place, ids = int(at[0]), now.views.table.ids
    suffix = f"?{query}" if query else ""

    def to(i: int) -> str | None:
        return quote(ids[int(rows[i])], safe="") + suffix if 0 <= i < len(rows) else None

    return to(place - 1), place + 1, to(place + 1), len(rows)


def _measures(now: OpenedDataset, name: str) -> Iterator[tuple[str, str]]:
    table, row = now.views.table, now.numbers[name]
    for measure in MEASURES:
        if measure.is_of_robot:
            continue
        value = table.value(row, measure.name)
        if value is not None:
            yield measure.title, f"{value:,g}{f' {measure.unit}' if measure.unit else ''}"
    reached: dict[str, list[str]] = {}  # radii by what is said of them: most homes have the same for several
    for radius in RADII:
        reach, narrowest = table.value(row, "reach", radius), table.value(row, "narrowest", radius)
        if reach is not None:
            width = "" if narrowest is None else f", narrowest passage {narrowest:g} m"
            reached.setdefault(f"{reach:.1%}{width}", []).append(radius)
    for said, radii in reached.items():
        yield f"Reached by a robot of radius {', '.join(radii)} m", said


def _provenance(plan: FloorPlan) -> Iterator[tuple[str, str]]:
    for key, value in (plan.provenance or {}).items():
        if words := _plain(value):
            yield key.replace("_", " "), words
    if plan.repair is not None:
        yield "repair", str(plan.repair)


def _plain(value: Any) -> str:
    """Return a JSON value as readable text, "" if it is empty."""
    if isinstance(value, Mapping):
        return ", ".join(f"{str(name).replace('_', ' ')}: {_plain(each)}" for name, each in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_plain, value))
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()


def _python(opening: str, name: str) -> str:
    return (
        "import houseexpo\n\n"
        f"{opening}\n"
        f"plan = plans[{name!r}]\n"
        "plan.area, plan.rooms, plan.doors\n"
        "plan.grid(25), plan.graph()"
    )


class DoorReason(NamedTuple):
    """A door: its number, its kind, the rooms on its sides, how sure it is ("" if not rated), and the reason for it."""

    number: int
    kind: str
    between: str
    sure: str
    why: str


class PlanEvidence(NamedTuple):
    """The evidence in a plan's file, in words; ``grounds`` are those against the plan, the strongest first."""

    quality: str
    grounds: list[tuple[str, float]]
    notes: list[str]
    doors: list[DoorReason]

    @property
    def has_ratings(self) -> bool:
        """Whether a door says how sure it is."""
        return any(door.sure for door in self.doors)

    def __bool__(self) -> bool:
        """Whether there is any evidence."""
        return any(self)


def plan_evidence(plan: FloorPlan) -> PlanEvidence:
    """Return the evidence in a plan's file; a provenance in an unknown form is ignored."""
    origin = plan.provenance or {}
    grounds = {} if plan.quality is None else plan.quality.grounds
    against = sorted(((GROUNDS.get(name, _with_spaces(name)), value) for name, value in grounds.items() if value > 0))
    return PlanEvidence(
        "" if plan.quality is None else _quality_text(plan.quality),
        sorted(against, key=lambda pair: -pair[1]),
        list(_notes(origin.get("notes"))),
        [_reason(plan, door, _cuts(origin.get("cuts"))) for door in plan.doors],
    )


def _quality_text(quality: Quality) -> str:
    how = f"doubtful, since it is below {SURE:g}" if quality.is_doubtful else f"sure, since it is {SURE:g} or more"
    against = sum(value > 0 for value in quality.grounds.values())
    found = f"{against or 'None'} of {count_noun(len(quality.grounds), 'possible fault')} was found"
    return f"Quality {quality.score:.2f}: {how}. {found if against < 2 else found.replace('was', 'were')}."


def _notes(notes: Any) -> Iterator[str]:
    if isinstance(notes, Mapping):
        for name, value in notes.items():
            key = f"{name}:{value}" if isinstance(value, str) else str(name)
            times = f" ({value})" if isinstance(value, int) else ""
            yield NOTES.get(key, _with_spaces(key)) + times


def _cuts(cuts: Any) -> dict[Any, str]:
    """Return the reason for the place of each cut, by the door's number."""
    found = [cut for cut in cuts if isinstance(cut, Mapping)] if isinstance(cuts, list | tuple) else []
    return {cut.get("door"): str(cut["why"]) for cut in found if cut.get("why")}


def _reason(plan: FloorPlan, door: Door, cuts: Mapping[Any, str]) -> DoorReason:
    place = cuts.get(door.id, "") if door.kind == "cut" else ""
    why = DOORS[door.kind] + (f"; cut here: {place}" if place else "")
    sure = "" if door.confidence is None else f"{door.confidence:.0%}"
    return DoorReason(door.id, door.kind, room_names_beside(plan, door), sure, why)


def room_names_beside(plan: FloorPlan, door: Door) -> str:
    """Return the names of the rooms on both sides of a door."""
    labels = {room.id: room.label for room in plan.rooms}
    return " and ".join("outside" if room is None else _with_spaces(labels.get(room, "room")) for room in door.rooms)


def _with_spaces(name: str) -> str:
    return name.replace("_", " ")
