"""``houseexpo info``: what a data set or a plan is, at a glance."""

from __future__ import annotations

import statistics
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.floorplan import FloorPlan
    from houseexpo.plan.quality import Quality


def info(
    what: Annotated[str, typer.Argument(help="A data set, a plan's file, or its id.", show_default=False)],
    data: Annotated[Path | None, typer.Option(help="The data set of the id; the fetched one by default.")] = None,
) -> None:
    """Say what a data set or a plan is."""
    from rich.console import Console

    from houseexpo.commands.given import plans
    from houseexpo.dataset import open_dataset

    path = Path(what)
    single = path.suffix == ".json" or not path.exists()
    rows = _of_plan(plans([what], data)[0]) if single else _of_data_set(open_dataset(path))
    console = Console()
    for name, value in rows:
        console.print(f"[bold]{name:14}[/]", value, highlight=False, soft_wrap=True)


def _of_data_set(plans: Dataset) -> list[tuple[str, str]]:
    rooms, area = plans.column("room_num"), plans.column("area")
    labels = Counter(label for found in plans.column("labels") for label in found)
    most = sorted(labels.items(), key=lambda pair: (-pair[1], pair[0]))
    return [
        ("data set", str(plans.path)),
        ("plans", f"{len(plans)}"),
        ("rooms", f"{_spread(rooms, '')}, {sum(rooms)} in all"),
        ("area", _spread(area, " m2")),
        *_quality(plans.column("quality")),
        ("labels", ", ".join(f"{label} {count}" for label, count in most) + " (plans with one)"),
        ("splits", ", ".join(f"{name} {len(plans.split(name))} of {len(ids)}" for name, ids in plans.splits.items())),
    ]


def _quality(scores: list[float | None]) -> list[tuple[str, str]]:
    """Say how sure the pipeline is of the plans; nothing where none says so."""
    from houseexpo.plan.quality import SURE

    known = [score for score in scores if score is not None]
    doubtful = sum(score < SURE for score in known)
    return [("quality", f"{_spread(known, '')}, {doubtful} doubtful (below {SURE:g})")] if known else []


def _spread(values: list[float], unit: str) -> str:
    if not values:
        return "none"
    low, middle, mean, high = min(values), statistics.median(values), statistics.fmean(values), max(values)
    return f"{low:g} to {high:g}{unit}, median {middle:g}{unit}, mean {mean:.3f}{unit}"


def _of_plan(plan: FloorPlan) -> list[tuple[str, str]]:
    x1, y1, x2, y2 = plan.bbox
    labels = {label: len(boxes) for label, boxes in plan.room_category.items()}
    rows = [
        ("plan", plan.id),
        ("area", f"{plan.area:.2f} m2 of free space in {x2 - x1:.2f} x {y2 - y1:.2f} m"),
        ("vertices", f"{len(plan.verts)}, {len(plan.holes)} holes"),
        ("rooms", f"{plan.room_num} as the source counts them"),
        ("boxes", ", ".join(f"{label} {count}" for label, count in labels.items())),
    ]
    rows += _of_quality(plan.quality)
    rows += [(f"room {room.id}", f"{room.label}, {room.area:.2f} m2") for room in plan.rooms]
    rows += [(f"door {d.id}", f"{d.kind}, {d.width:.2f} m, {d.rooms[0]} to {d.rooms[1]}") for d in plan.doors]
    for thing in plan.objects:
        rows.append((f"object {thing.id}", f"{thing.label}, {thing.height:.2f} m high, in room {thing.room}"))
    for radius in (0.1, 0.2, 0.3):
        found = plan.navigability(radius)
        reach = (
            f"{found.components} pieces, {found.largest_share:.1%} in the biggest, {found.narrowest:.2f} m narrowest"
        )
        rows.append((f"robot {radius:.2f} m", reach))
    if plan.repair is not None:
        rows.append(("repair", str(plan.repair)))
    return rows


def _of_quality(quality: Quality | None) -> list[tuple[str, str]]:
    if quality is None:
        return []
    judged = "doubtful" if quality.is_doubtful else "sure"
    grounds = [(f"  {name}", f"{value:g}") for name, value in quality.grounds.items()]
    return [("quality", f"{quality.score:.2f}, {judged}"), *grounds]
