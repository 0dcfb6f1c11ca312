"""Draw what a stage did to houses drawn at random, before and after, so that people can look at it: a sheet a stage.

``python -m research.stage_sheets OUT SOURCE...`` takes sources as ``houseexpo build`` does, and writes ``cuts.png``,
``left_out.png``, ``erased.png``, ``straightened.png`` and ``labels.png``, each with 30 examples from different houses.
What was seen on them is in ``docs/paper.md``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib import pyplot as plt
from shapely.geometry.base import BaseGeometry

from houseexpo.plan.parts import Room
from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.geometry.areas import ignore_division_warnings, unite
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level, RejectedLevel

NUMBER: Final = 30
MOVED_M: Final = 0.01  # an outline whose corners moved by less looks the same
COLUMNS: Final = 6


@dataclass(frozen=True)
class Example:
    """A house before and after a stage: shapes in grey, what the stage changed in red, and texts at places."""

    house: str
    grey: BaseGeometry
    red: BaseGeometry
    texts: tuple[tuple[float, float, str], ...] = ()
    near: BaseGeometry | None = None


def stages_of(level: Level, seed: int) -> dict[str, Any]:
    """Return the values of the stages of a level, of its last building from ``isolated`` on; and the rooms of all."""
    results = list(run_stages(level, PipelineConfig(), np.random.default_rng(seed)))
    rooms = [room for result in results if result.stage == "connectivity" for room in result.value.rooms]
    return {**{result.stage: result.value for result in results}, "rooms of all": rooms}


def levels_of(sources: list[str]) -> Iterator[Level]:
    """Yield the levels of all inputs that can be read."""
    for source in sources:
        for item in find(source):
            try:
                for level in reader(item.reader).read(item):
                    if not isinstance(level, RejectedLevel):
                        yield level
            except Rejection as rejection:
                print(f"{item.id}: {rejection.reason}", file=sys.stderr)  # noqa: T201


def cuts(level: Level, found: dict[str, Any]) -> Iterator[Example]:
    """Yield each cut, where no door is seen, with the walls about it."""
    spaces = found["connectivity"]
    walls = spaces.walls.difference(unite([p.strip() for p in spaces.passages]))
    for passage in spaces.passages:
        if passage.kind == "cut":
            yield Example(level.id, walls, passage.strip())


def left_out(level: Level, found: dict[str, Any]) -> Iterator[Example]:
    """Yield each closed space that was filled or left out: of P_g', but of no room."""
    before, after = found["doors"], found["connectivity"]
    apart = [room for room in found["cells"].rooms if not any(room.equals(other) for other in found["isolated"].rooms)]
    stay = unite([*found["rooms of all"], *apart])
    gone = [room for room in before.rooms if not room.intersects(stay)]
    for space in [*gone, *after.closed]:
        yield Example(level.id, before.walls, space, ((*space.centroid.coords[0], f"{space.area:.1f}"),))


def erased(level: Level, found: dict[str, Any]) -> Iterator[Example]:
    """Yield the parts of a house that were erased as isolated."""
    before, after = found["cells"], found["isolated"]
    gone = [outline for outline in before.outlines if not any(outline.equals(other) for other in after.outlines)]
    if gone:
        texts = tuple((*one.centroid.coords[0], f"{one.area:.0f} m2") for one in before.outlines)
        yield Example(level.id, before.walls, unite(gone), texts, before.walls)


def straightened(level: Level, found: dict[str, Any]) -> Iterator[Example]:
    """Yield the outlines of rooms before, over those after."""
    before, after = found["connectivity"].rooms, found["refine"].rooms
    moved = [one for one, other in zip(before, after, strict=False) if one.hausdorff_distance(other) > MOVED_M]
    if moved:
        one = moved[0]
        yield Example(level.id, unite(after).boundary.buffer(0.015), one.boundary.buffer(0.004), (), one)


def room_text(room: Room) -> str:
    """Return a room's label and, where they differ, the source's words."""
    said = ", ".join(room.source_labels)
    return room.label if said in {"", room.label} else f"{room.label}\n({said})"


def labels(level: Level, found: dict[str, Any]) -> Iterator[Example]:
    """Yield a plan with the labels of its rooms."""
    plan = found["plan"]
    shapes = [shapely.Polygon(room.ring, room.holes) for room in plan.rooms]
    if shapes:
        places = (shape.representative_point().coords[0] for shape in shapes)
        texts = tuple((*place, room_text(room)) for place, room in zip(places, plan.rooms, strict=True))
        walls = unite([shape.boundary.buffer(0.05) for shape in shapes])
        yield Example(level.id, walls, shapely.Polygon(), texts, walls)


SHEETS: Final[dict[str, Callable[[Level, dict[str, Any]], Iterator[Example]]]] = {
    "cuts": cuts,
    "left_out": left_out,
    "erased": erased,
    "straightened": straightened,
    "labels": labels,
}


def draw_sheet(examples: list[Example], file: Path) -> None:
    """Draw examples on a sheet, each with 3 m around what was changed."""
    rows = -(-len(examples) // COLUMNS)
    figure, axes = plt.subplots(rows, COLUMNS, figsize=(3 * COLUMNS, 3 * rows), squeeze=False)
    for ax in axes.flat:
        ax.axis("off")
    for number, (ax, example) in enumerate(zip(axes.flat, examples, strict=False), start=1):
        for shape, colour in ((example.grey, "0.6"), (example.red, "tab:red")):
            for part in shapely.get_parts(shape):
                if isinstance(part, shapely.Polygon) and not part.is_empty:
                    rings = [part.exterior, *part.interiors]
                    path = mpl.path.Path.make_compound_path(*(mpl.path.Path(np.asarray(ring.coords)) for ring in rings))
                    ax.add_patch(mpl.patches.PathPatch(path, facecolor=colour, edgecolor="none", alpha=0.8))
        low_x, low_y, high_x, high_y = (example.near if example.near is not None else example.red.buffer(3.0)).bounds
        for x, y, text in example.texts:
            ax.text(x, y, text, fontsize=6, ha="center", va="center", clip_on=True)
        ax.set_xlim(low_x - 0.3, high_x + 0.3)
        ax.set_ylim(low_y - 0.3, high_y + 0.3)
        ax.set_aspect("equal")
        ax.set_title(f"{number} {example.house[-22:]}", fontsize=6)
    figure.tight_layout()
    figure.savefig(file, dpi=70)
    plt.close(figure)


def main(out: str, *sources: str) -> None:
    """Write the sheets."""
    mpl.use("agg")
    folder, rng = Path(out), np.random.default_rng(56)
    folder.mkdir(parents=True, exist_ok=True)
    kept: dict[str, list[Example]] = {name: [] for name in SHEETS}
    with ignore_division_warnings():
        for number, level in enumerate(levels_of(list(sources))):
            try:
                found = stages_of(level, number)
            except Rejection:
                continue
            if "plan" not in found:  # of several buildings, the last was rejected
                continue
            for name, examples in SHEETS.items():
                if each := list(examples(level, found)):
                    kept[name].append(each[int(rng.integers(len(each)))])  # one of a house
    for name, all_found in kept.items():
        order = rng.permutation(len(all_found))[:NUMBER]
        draw_sheet([all_found[k] for k in order], folder / f"{name}.png")
        print(f"{name}: {len(order)} of {len(all_found)} houses")  # noqa: T201


if __name__ == "__main__":
    main(*sys.argv[1:])
