"""``houseexpo info``: print a summary of a data set or of plans, as text or JSON."""

from __future__ import annotations

import statistics
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from houseexpo.commands.arguments import IDS_HELP
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.floorplan import FloorPlan
    from houseexpo.plan.parts import Quality


def info(
    what: Annotated[list[str], typer.Argument(help="A data set, plans' files, or ids.", show_default=False)],
    data: Annotated[
        Path | None, typer.Option("--dataset", "--data", help="The data set of the ids; the fetched one by default.")
    ] = None,
    ids: Annotated[list[str] | None, typer.Option(help=IDS_HELP, show_default="the data set as a whole")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")] = False,
) -> None:
    """Show a summary of a data set or of plans."""
    from houseexpo.commands.arguments import is_data_set, plans_from_arguments
    from houseexpo.commands.printing import make_console, print_json, print_name_and_text
    from houseexpo.dataset import open_dataset

    if len(what) == 1 and is_data_set(what[0]) and not ids:
        told = [_of_data_set(open_dataset(what[0]))]
    else:
        told = [_of_plan(plan) for plan in plans_from_arguments(what, data, ids)]
    if json:
        values = [{name.strip(): value for name, value, _ in rows} for rows in told]
        print_json(values[0] if len(values) == 1 else values)
        return
    out = make_console()
    for number, rows in enumerate(told):
        if number:
            out.print()
        for name, _, said in rows:
            if said:
                print_name_and_text(out, f"{name:14}", said)


_Row = tuple[str, Any, str]
"""A name, its value for programs, and its text for people; an empty text is not shown."""


def _of_data_set(plans: Dataset) -> list[_Row]:
    rooms = [count for count in plans.column("rooms", compute=False) if count is not None]
    source_rooms, area = plans.column("source_rooms"), plans.column("area")
    labels = Counter(label for found in plans.column("labels") for label in found)
    most = dict(sorted(labels.items(), key=lambda pair: (-pair[1], pair[0])))
    splits = {name: {"plans": len(plans.split(name)), "ids": len(ids)} for name, ids in plans.splits.items()}
    return [
        ("data set", str(plans.path), str(plans.path)),
        ("plans", len(plans), f"{len(plans)}"),
        ("rooms", _summary(rooms), _count_words(rooms) + _of(rooms, plans) if rooms else "not recorded"),
        ("source_rooms", _summary(source_rooms), _count_words(source_rooms)),
        ("area", _summary(area), _range_words(area, " m²")),
        *_quality(plans),
        ("labels", most, _label_words(most)),
        ("splits", splits, ", ".join(f"{name} {n['plans']} of {n['ids']}" for name, n in splits.items()) or "none"),
    ]


def _label_words(most: dict[str, int]) -> str:
    """Return how many plans have each label, or that none has one."""
    return ", ".join(f"{label} {count}" for label, count in most.items()) + " (plans with one)" if most else "none"


def _of(known: list[Any], plans: Dataset) -> str:
    """Return of how many plans a value is known, nothing if of all."""
    return "" if len(known) == len(plans) else f"; known of {len(known)} of {count_noun(len(plans), 'plan')}"


def _quality(plans: Dataset) -> list[_Row]:
    """Return the row on the plans' quality scores, none if no plan has one."""
    from houseexpo.plan.parts import SURE

    known = [score for score in plans.column("quality") if score is not None]
    doubtful = sum(score < SURE for score in known)
    said = f"{_range_words(known, '')}, {doubtful} doubtful (below {SURE:g}){_of(known, plans)}"
    return [("quality", {**_summary(known), "doubtful": doubtful}, said)] if known else []


def _summary(values: list[float]) -> dict[str, float]:
    if not values:
        return {}
    middle, mean = statistics.median(values), statistics.fmean(values)
    return {
        "count": len(values),
        "min": min(values),
        "max": max(values),
        "median": middle,
        "mean": mean,
        "sum": sum(values),
    }


def _range_words(values: list[float], unit: str) -> str:
    if not values:
        return "none"
    found = _summary(values)
    ends = f"{found['min']:g} to {found['max']:g}{unit}"
    return f"{ends}, median {found['median']:g}{unit}, mean {found['mean']:.3f}{unit}"


def _count_words(values: list[float]) -> str:
    return f"{_range_words(values, '')}, {sum(values)} in all"


def _of_plan(plan: FloorPlan) -> list[_Row]:
    x1, y1, x2, y2 = plan.bbox
    labels = {label: len(boxes) for label, boxes in plan.room_category.items()}
    size = {"m2": plan.area, "width_m": x2 - x1, "height_m": y2 - y1}
    vertices = {"outline": len(plan.verts), "holes": len(plan.holes)}
    rows: list[_Row] = [
        ("plan", plan.id, plan.id),
        ("area", size, f"{plan.area:.2f} m² of free space in {x2 - x1:.2f} x {y2 - y1:.2f} m"),
        ("vertices", vertices, f"{len(plan.verts)}, {count_noun(len(plan.holes), 'hole')}"),
        ("rooms", len(plan.rooms) or None, f"{len(plan.rooms)}" if plan.rooms else "not recorded"),
        ("source_rooms", plan.room_num, f"{plan.room_num}"),
        ("boxes", labels, ", ".join(f"{label} {count}" for label, count in labels.items()) or "none"),
    ]
    rows += _of_quality(plan.quality)
    for room in plan.rooms:
        value = {"label": room.label, "m2": room.area}
        rows.append((f"room {room.id}", value, f"{room.label}, {room.area:.2f} m²"))
    for door in plan.doors:
        one, other = ("outside" if room is None else room for room in door.rooms)
        value = {"kind": door.kind, "width_m": door.width, "rooms": list(door.rooms)}
        rows.append((f"door {door.id}", value, f"{door.kind}, {door.width:.2f} m, {one} to {other}"))
    for window in plan.windows:
        low, high = (f"{'?' if each is None else format(each, '.2f')}" for each in (window.sill, window.head))
        value = {"width_m": window.width, "sill_m": window.sill, "head_m": window.head, "rooms": list(window.rooms)}
        one, other = ("outside" if room is None else room for room in window.rooms)
        said = f"{window.width:.2f} m, {low} to {high} m above the floor, {one} to {other}"
        rows.append((f"window {window.id}", value, said))
    for thing in plan.objects:
        value = {"label": thing.label, "height_m": thing.height, "room": thing.room}
        where = "in no room" if thing.room is None else f"in room {thing.room}"
        rows.append((f"object {thing.id}", value, f"{thing.label}, {thing.height:.2f} m high, {where}"))
    rows += [_of_robot(plan, radius) for radius in (0.1, 0.2, 0.3)]
    if plan.repair is not None:
        rows.append(("repair", str(plan.repair), str(plan.repair)))
    return rows


def _of_robot(plan: FloorPlan, radius_m: float) -> _Row:
    found = plan.navigability(radius_m)
    value = {"pieces": found.components, "largest_share": found.largest_share, "narrowest_m": found.narrowest}
    pieces = count_noun(found.components, "piece")
    said = f"{pieces}, {found.largest_share:.1%} in the largest, narrowest passage {found.narrowest:.2f} m"
    return (f"robot {radius_m:.2f} m", value, said)


def _of_quality(quality: Quality | None) -> list[_Row]:
    if quality is None:
        return []
    from houseexpo.plan.explanations import GROUNDS

    judged = "doubtful" if quality.is_doubtful else "sure"
    grounds: list[_Row] = []
    for name, value in quality.grounds.items():
        about = f", {GROUNDS[name]}" if name in GROUNDS else ""
        grounds.append((f"  {name}", value, f"{value:g}{about}" if value > 0 else ""))
    against = sum(value > 0 for value in quality.grounds.values())
    said = f"{quality.score:.2f}, {judged}; {against or 'none'} of {len(quality.grounds)} grounds against it"
    return [("quality", quality.score, said if quality.grounds else f"{quality.score:.2f}, {judged}"), *grounds]
