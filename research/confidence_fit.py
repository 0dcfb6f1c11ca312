"""Gather what the models of ``weights.toml`` are fitted on, and fit those of confidences: see ``research.weights_fit``.

Made houses (every third one damaged) and the corpus's first half are what they learn from; real houses count as much as
all made ones together. What is true of a real file says its drawn truth (``tests.corpus.truths``); where there is none,
the marks that people have put on the parts of its plans (``tests.corpus.marks``); where there are none either, its
verdict: of a right plan all parts but cuts are true, of a wrong one none. Where a
truth names no entrance, what the plan has of them is not judged. A door is true where a passage of the truth has its
middle within 0.35 m, a room where it overlaps one of the truth's by an IoU of 0.7, a space (``stages.room_doubt``)
where half of it lies in the truth's rooms.

A plan is right where the verdict on its file is, or where a made house meets the table of its kind.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from rich.table import Table
from shapely import Polygon

from houseexpo.dataset.storey_labels import NEAR_WAY_M
from houseexpo.errors import HouseExpoError
from pipeline.config import PipelineConfig
from pipeline.executors.local import Failure, Limits, run
from pipeline.fitting.labels import SAME_EXTENT, read_labels
from pipeline.fitting.rows import HouseRows, Origin, Part, Told, rows_of, rows_of_labels
from pipeline.geometry.areas import intersect, unite
from pipeline.geometry.openings import Opening
from pipeline.rejection import Rejection
from pipeline.source_record import extent_of
from pipeline.sources import find, reader
from pipeline.stages.logistic import FITTED
from pipeline.tolerances import MOST, SHEET_M
from pipeline.values import Input, Level
from research.built_houses import built_file, built_member
from tests.builders.judged import area_under_curve
from tests.builders.kinds.measuring import SAME_FLOOR_M, paired
from tests.builders.matching import which_near
from tests.builders.shared import as_json
from tests.corpus import manifest, marks, runs, truths

Floats = npt.NDArray[np.float64]
Found = TypeVar("Found")
LIMITS = Limits(seconds=1800.0, memory=8 << 30)
"""Far more than any of the houses takes: a fit that lost some would not be the same again."""
SAME_IOU = 0.7
DRAWS = 1000
"""How often the calibration error of a model without fault is drawn."""
BINS = 10


class Known(msgspec.Struct, frozen=True):
    """What a storey has, in the source's plan axes: middles of inner passages and of entrances, and room areas."""

    doors: Floats
    entrances: Floats
    rooms: list[Polygon]

    def judge_rooms(self, rooms: Sequence[Polygon]) -> list[bool | None]:
        """Tell which rooms overlap a true one by ``SAME_IOU``, also one of several rooms that no wall parts."""
        return [bool(each) for each in _alike(self.rooms, rooms)]

    def judge_spaces(self, spaces: Sequence[Polygon], rooms: Sequence[Polygon]) -> list[bool | None]:  # noqa: ARG002
        """Tell which spaces lie in the true rooms."""
        indoors = unite(room.buffer(SHEET_M) for room in self.rooms)
        return [intersect(space, indoors).area > MOST * space.area for space in spaces]

    def judge_ways(self, middles: Floats, passages: Sequence[Opening]) -> list[bool | None]:
        """Tell which passages are true ones; of entrances nobody knows where the truth has none."""
        found: list[bool | None] = [None] * len(middles)
        for outside, true in ((False, self.doors), (True, self.entrances)):
            which = [k for k, passage in enumerate(passages) if passage.leads_outside == outside]
            if outside and not len(true):
                continue
            for k, is_true in zip(which, which_near(true, middles[which], NEAR_WAY_M), strict=True):
                found[k] = bool(is_true)
        return found


class Verdict(msgspec.Struct, frozen=True):
    """What is known of a plan of which somebody says only whether it is right."""

    right: bool

    def judge_rooms(self, rooms: Sequence[Polygon]) -> list[bool | None]:
        """Tell that all rooms are as the plan."""
        return [self.right] * len(rooms)

    def judge_spaces(self, spaces: Sequence[Polygon], rooms: Sequence[Polygon]) -> list[bool | None]:
        """Tell which spaces the right plan kept; of a wrong one that nobody has marked, nobody knows."""
        kept = unite(room.buffer(0) for room in rooms)
        return [intersect(space, kept).area > MOST * space.area if self.right else None for space in spaces]

    def judge_ways(self, middles: Floats, passages: Sequence[Opening]) -> list[bool | None]:  # noqa: ARG002
        """Tell that all passages are as the plan; a right one may have cuts where the source shows no door."""
        return [None if self.right and passage.kind == "cut" else self.right for passage in passages]


def _alike(true: Sequence[Polygon], found: Sequence[Polygon]) -> npt.NDArray[np.bool_]:
    """Which found rooms (n,) are like a true one; a true one may stand for rooms that no wall parts, too."""
    right = np.zeros(len(found), np.bool_)
    for k, room in enumerate(found):
        shared = shapely.area(shapely.intersection(room.buffer(0), np.array(true, np.object_)))
        right[k] = bool(len(true)) and (shared / (room.area + shapely.area(true) - shared)).max() >= SAME_IOU
    return right


def of_member(task: tuple[str, int], seed: int, folder: Path, built: Path | None) -> HouseRows:
    """Return the rows of a made house; every third one is damaged first."""
    kind, number = task
    house = built_member(task, seed, folder, built)
    plans = [as_json(building.plan) for _, buildings in house.storeys for building in buildings]
    met = {score["plan"] for score in paired(house.truths, plans)[0] if "plan" in score and not score["failing"]}
    right = iter([k in met for k in range(len(plans))])
    storeys = []
    for level, buildings in house.storeys:
        here = of_storey(house.truths, level)
        storeys.append((level, buildings, [_of_cases(here)] if here else [], [next(right) for _ in buildings]))
    name = f"{kind} {number}"
    return rows_of(storeys, Origin(name, kind, name))


def of_storey(truths_: Sequence[Mapping[str, Any]], level: Level) -> list[Mapping[str, Any]]:
    """Return the truths of the storey that a level shows: one for each of its buildings."""
    return [truth for truth in truths_ if abs(truth["floor_z"] - level.frame.floor) <= SAME_FLOOR_M]


def zones_of(truth: Mapping[str, Any]) -> list[Polygon]:
    """Return the areas that walls part from each other: a room, or several between which no wall stands."""
    rooms = [Polygon(r["polygon"], r["holes"]).buffer(0) for r in truth["rooms"]]
    groups = truth.get("zones") or [[k] for k in range(len(rooms))]
    return [shapely.union_all([rooms[i].buffer(0.02) for i in group]).buffer(-0.02) for group in groups]


def _of_cases(truths_: Sequence[Mapping[str, Any]]) -> Known:
    """Return what the buildings of one storey have."""
    rooms = [Polygon(r["polygon"], r["holes"]).buffer(0) for truth in truths_ for r in truth["rooms"]]
    doors = [door for truth in truths_ for door in truth["doors"]]
    inner = [door["centre"] for door in doors if door["interior"]]
    outer = [door["centre"] for door in doors if not door["interior"]]
    zones = [zone for truth in truths_ for zone in zones_of(truth)]
    return Known(np.reshape(inner, (-1, 2)), np.reshape(outer, (-1, 2)), rooms + zones)


def of_file(name: str, folder: Path, built: Path | None) -> HouseRows:
    """Return the rows of a file of the corpus: by what somebody has drawn, or marked, or else by its verdict."""
    file = next(file for file in manifest.load() if file.name == name)
    house = built_file(file, folder, built)
    verdict, _ = runs.verdict_of(file, house.outcome)
    truth, marked = truths.load(name), marks.load().get(name)
    right = verdict is manifest.Verdict.RIGHT if verdict else None
    storeys = []
    for level, buildings in house.storeys:
        told: list[Told] = []
        if truth:
            told += [_of_drawing(level, storey) for storey in _drawn_of(truth, level)]
        elif marked is not None:
            told += [storey for storey in marked if storey.is_of(level)]
        elif verdict in {manifest.Verdict.RIGHT, manifest.Verdict.WRONG}:
            told.append(Verdict(verdict is manifest.Verdict.RIGHT))
        storeys.append((level, buildings, told, [right] * len(buildings)))
    return rows_of(storeys, Origin(name, f"corpus {file.half}", file.repository.lower(), name))


def of_reviewed(item: Input, labels: Path) -> HouseRows:
    """Return the rows of an input that somebody has reviewed (``houseexpo labels``)."""
    return rows_of_labels(item, read_labels(labels)[item], PipelineConfig())


def _of_drawing(level: Level, storey: truths.Storey) -> Known:
    """Return what somebody has drawn of a level."""
    inner = [d.middle for d in storey.doors if d.interior]
    inner += [np.reshape(s, (2, 2)).mean(axis=0) for s in storey.open]
    outer = [d.middle for d in storey.doors if not d.interior]
    return Known(np.reshape(inner, (-1, 2)), np.reshape(outer, (-1, 2)), truths.rooms_of(level, storey))


def storeys_of(file: manifest.File, folder: Path) -> Iterator[tuple[Level, truths.Storey]]:
    """Yield the levels of a file with what somebody has drawn of them; a level of another size has nothing drawn."""
    truth = truths.load(file.name)
    for level in levels_of(file.place(folder)) if truth else ():
        yield from ((level, storey) for storey in _drawn_of(truth, level))


def _drawn_of(truth: truths.Truth | None, level: Level) -> list[truths.Storey]:
    """Return what somebody has drawn of a level."""
    storeys = [storey for storey in truth.storeys if storey.level == level.frame.level] if truth else []
    return [s for s in storeys if np.allclose(extent_of(level), s.extent, rtol=SAME_EXTENT, atol=SAME_EXTENT)]


def levels_of(path: Path) -> list[Level]:
    """Return the levels of a file that are no rejections."""
    found = []
    try:
        for item in find(str(path)):
            found += [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    except Rejection:
        pass
    return found


def weights_of(parts: Sequence[Part]) -> Floats:
    """Return the weight of each part: real houses count as much as all made ones together.

    A real house with many parts counts with the root of their number: all may be right or wrong for one reason. All
    weights sum up to the number of parts, so that the ridge is as strong however few houses are made.
    """
    real = np.array([part.group.startswith("corpus") for part in parts])
    if real.all() or not real.any():
        return np.ones(len(parts))
    count = Counter(part.house for part in parts)
    weight = np.where(real, np.array([count[part.house] ** -0.5 for part in parts]), 1.0)
    return np.where(real, weight / weight[real].sum(), weight / weight[~real].sum()) * len(parts) / 2


def measures(scores: Floats, true: npt.NDArray[np.bool_]) -> dict[str, float]:
    """Area under the curve, Brier score, and the expected calibration error over ``BINS`` bins of equal width.

    ``by chance`` is the calibration error that so few parts would show on average if each of them were true with
    exactly the probability that its score says, and independently of the others.
    """
    rng = np.random.default_rng(0)
    drawn = [_calibration_error(scores, rng.random(len(scores)) < scores) for _ in range(DRAWS)]
    return {
        "area": area_under_curve(scores, true),
        "brier": float(((scores - true) ** 2).mean()),
        "calibration": _calibration_error(scores, true),
        "by chance": float(np.mean(drawn)),
    }


def _calibration_error(scores: Floats, true: npt.NDArray[np.bool_]) -> float:
    """Return the mean over all parts of the difference between the mean score of a bin and its share of true parts."""
    which = np.minimum((scores * BINS).astype(int), BINS - 1)
    sums = np.bincount(which, scores - true, minlength=BINS)
    return float(np.abs(sums).sum() / len(scores))


def table_of(scored: Sequence[tuple[Part, float]]) -> Table:
    """Show how good the confidences of parts are, a row for each sort of part and group."""
    table = Table(title="Confidence of spaces, doors, entrances and rooms")
    for k, heading in enumerate(("part", "of", "n", "true", "mean", "area", "Brier", "calibration error", "by chance")):
        table.add_column(heading, justify="right" if k > 1 else "left")
    for name in FITTED:
        for group in sorted({part.group for part, _ in scored}):
            chosen = [(part.true, score) for part, score in scored if (part.part, part.group) == (name, group)]
            if chosen:
                true, scores = np.array([true for true, _ in chosen]), np.array([score for _, score in chosen])
                found = measures(scores, true)
                figures = [f"{x:.2f}" for x in (true.mean(), scores.mean(), *found.values())]
                table.add_row(name, group, str(len(chosen)), *figures)
    return table


def collect(
    kinds: Sequence[str],
    members: int,
    seed: int,
    corpus: Path | None,
    built: Path | None,
    *,
    both_halves: bool = False,
    labels: Path | None = None,
) -> list[HouseRows]:
    """Return the rows of made houses and of the corpus, of its first half only unless both are asked for.

    ``built`` is where the houses are kept as they were built; None to keep none. ``labels`` are those of reviewed
    houses, whose files are where they were.
    """
    with tempfile.TemporaryDirectory() as folder:
        tasks = [(kind, number) for number in range(members) for kind in kinds]
        found = in_order(partial(of_member, seed=seed, folder=Path(folder), built=built), tasks)
    if corpus:
        files = [file for file in manifest.load() if (both_halves or file.half == 1) and file.is_in(corpus)]
        found += in_order(partial(of_file, folder=corpus, built=built), [file.name for file in files])
    if labels:
        found += in_order(partial(of_reviewed, labels=labels), list(read_labels(labels)))
    return found


def collect_parts(kinds: Sequence[str], members: int, seed: int) -> list[Part]:
    """Return the parts of made houses, with the doubts that the models of today have of their spaces and plans."""
    rows = collect(kinds, members, seed, None, None)
    return [part for row in rows for plan in row.plans for part in plan.parts] + [p for row in rows for p in row.spaces]


def in_order(function: Callable[[Any], Found], items: Sequence[Any]) -> list[Found]:
    """Return what a function makes of items, in their order; raise HouseExpoError if one of them is lost."""
    results = dict(run(function, items, workers=2, limits=LIMITS))
    lost = [f"{item}: {results[item]}" for item in items if isinstance(results[item], Failure)]
    if lost:
        raise HouseExpoError(f"{len(lost)} of {len(items)} houses gave nothing: {'; '.join(lost)[:500]}")
    return [results[item] for item in items]
