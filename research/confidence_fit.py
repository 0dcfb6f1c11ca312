"""Fit the models of ``pipeline.stages.confidence`` and write their table, ``weights.toml``.

::

    python -m research.confidence_fit --members 6 --corpus checkouts --built built --write

``--built`` keeps the houses as they were built (``research.built_houses``), and builds none that is there already.

Made houses (every third one damaged) and the corpus's first half are what it learns from; real houses count as much as
all made ones together. What is true of a real file says its drawn truth (``tests.corpus.truths``); where there is none,
the marks that people have put on the parts of its plans (``tests.corpus.marks``); where there are none either, its
verdict: of a right plan all parts but cuts are true, of a wrong one none. The second half is only counted, where
``--both-halves`` asks for it. Where a
truth names no entrance, what the plan has of them is not judged. A door is true where a passage of the truth has its
middle within 0.35 m, a room where it overlaps one of the truth's by an IoU of 0.7, a space (``stages.room_doubt``)
where half of it lies in the truth's rooms. The model of spaces is fitted first, since that of rooms rests on it.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, get_args

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from rich.console import Console
from rich.table import Table
from scipy.optimize import minimize
from shapely import Polygon

from houseexpo.errors import HouseExpoError
from pipeline.executors.local import Failure, Limits, run
from pipeline.geometry.areas import intersect, unite
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.stages import confidence, room_doubt
from pipeline.stages.logistic import LogisticModel, load_models
from pipeline.tolerances import MOST, SHEET_M
from pipeline.values import Evidence, Layout, Level, Spaces
from research.built_houses import Building, built_file, built_member
from tests.builders.judged import area_under_curve
from tests.builders.kinds.measuring import SAME_FLOOR_M
from tests.builders.kinds.registry import KINDS, RAW
from tests.builders.matching import which_near
from tests.corpus import manifest, marks, runs, truths

Floats = npt.NDArray[np.float64]
Found = TypeVar("Found")
WEIGHTS = Path(confidence.__file__).with_name("weights.toml")
LIMITS = Limits(seconds=600.0, memory=8 << 30)
"""Far more than any of the houses takes: a fit that lost some would not be the same again."""
SAME_IOU = 0.7
RIDGE = 1.5
"""How strongly weights are kept small: the likelier of 1.5 and 3 for entrances of files left out of the fit."""
SPACE = "space:"
DRAWS = 1000
"""How often the calibration error of a model without fault is drawn."""
OF_ROOM = frozenset({"odd_room", "jutting_wall"})
"""What doors say of their rooms. Of entrances left out of the fit, it makes the probabilities worse."""
PARTS: tuple[str, ...] = ("space", *get_args(confidence.Part))
BINS = 10


class Part(msgspec.Struct, frozen=True):
    """A door, an entrance, a room or a space: where it comes from, whether it is true, and its features.

    A room has the features of its space as well, each after ``SPACE``.
    """

    part: str
    house: str
    group: str
    true: bool
    features: dict[str, float]


class Known(msgspec.Struct, frozen=True):
    """What a storey has, in the source's plan axes: middles of inner passages and of entrances, and room areas."""

    doors: Floats
    entrances: Floats
    rooms: list[Polygon]


def parts_of(
    level: Level, buildings: Sequence[Building], known: Known | marks.Marked | bool, house: str, group: str
) -> Iterator[Part]:
    """Tell which parts of a level with its buildings are true; a level that is rejected has none."""
    for building in buildings:
        yield from _judge_parts(building.rated(level), known, house, group)
    if buildings and room_doubt.is_doubted(level, buildings[0].layout):
        yield from _judge_spaces(level, buildings[0], known, house, group)


def _judge_parts(
    planned: confidence.FinalBuilding, known: Known | marks.Marked | bool, house: str, group: str
) -> Iterator[Part]:
    level, layout, spaces = planned.level, planned.layout, planned.spaces
    features = confidence.passage_features(planned)
    middles = truths.in_source(level, np.array([p.portal.centre for p in spaces.passages]).reshape(-1, 2))
    rooms = [_to_source(level, room.polygon) for room in planned.named]
    for passage, row, true in zip(spaces.passages, features, _judge_ways(spaces, middles, known), strict=True):
        if true is not None:
            yield Part(confidence.model_for_passage(passage), house, group, bool(true), row)
    of_spaces = _space_rows(level, planned.evidence, layout) if room_doubt.is_doubted(level, layout) else []
    numbers = np.arange(len(of_spaces), dtype=np.float64)
    its = room_doubt.of_rooms(layout, numbers, [room.polygon for room in planned.named]).astype(int).tolist()
    for k, (row, true) in enumerate(zip(confidence.room_features(planned), _judge_rooms(rooms, known), strict=True)):
        if true is not None:
            of_space = {SPACE + name: value for name, value in of_spaces[its[k]].items()} if of_spaces else {}
            yield Part("room", house, group, bool(true), row | of_space)


def _space_rows(level: Level, evidence: Evidence, layout: Layout) -> list[dict[str, float]]:
    """Return the features of each space (``stages.room_doubt``)."""
    table = room_doubt.space_features(level, evidence, layout)
    return [{name: round(float(row[k]), 4) for name, row in table.items()} for k in range(len(layout.spaces))]


def _judge_spaces(
    level: Level, building: Building, known: Known | marks.Marked | bool, house: str, group: str
) -> Iterator[Part]:
    """Tell which spaces of a layout are indoors. Of a wrong plan that nobody has marked, nobody knows."""
    evidence, layout = building.evidence, building.layout
    here = [_to_source(level, space).buffer(0) for space in layout.spaces]
    told: Sequence[bool | None]
    if isinstance(known, bool):
        kept = unite(layout.rooms)
        told = [intersect(space, kept).area > MOST * space.area if known else None for space in layout.spaces]
    elif isinstance(known, marks.Marked):
        told = known.judge_spaces(here)
    else:
        indoors = unite(room.buffer(SHEET_M) for room in known.rooms)
        told = [intersect(space, indoors).area > MOST * space.area for space in here]
    for row, true in zip(_space_rows(level, evidence, layout), told, strict=True):
        if true is not None:
            yield Part("space", house, group, true, row)


def _judge_ways(spaces: Spaces, middles: Floats, known: Known | marks.Marked | bool) -> list[bool | None]:
    """Return which passages (n, 2) are ways; None where nobody knows."""
    if isinstance(known, bool):  # a right plan may have cuts where the source shows no door
        return [None if known and passage.kind == "cut" else known for passage in spaces.passages]
    if isinstance(known, marks.Marked):
        return known.judge_ways(middles)
    found: list[bool | None] = [None] * len(middles)
    for outside, true in ((False, known.doors), (True, known.entrances)):
        which = [k for k, passage in enumerate(spaces.passages) if passage.leads_outside == outside]
        if outside and not len(true):
            continue
        for k, is_true in zip(which, which_near(true, middles[which], truths.NEAR_M), strict=True):
            found[k] = bool(is_true)
    return found


def _judge_rooms(rooms: Sequence[Polygon], known: Known | marks.Marked | bool) -> list[bool | None]:
    """Return which rooms, in the source's plan axes, are like true ones; None where nobody knows."""
    if isinstance(known, bool):
        return [known] * len(rooms)
    if isinstance(known, marks.Marked):
        return known.judge_rooms(rooms)
    return [bool(each) for each in _alike(known.rooms, rooms)]


def _to_source(level: Level, room: Polygon) -> Polygon:
    return shapely.transform(room, lambda points: truths.in_source(level, points))


def _alike(true: Sequence[Polygon], found: Sequence[Polygon]) -> npt.NDArray[np.bool_]:
    """Which found rooms (n,) are like a true one; a true one may stand for rooms that no wall parts, too."""
    right = np.zeros(len(found), np.bool_)
    for k, room in enumerate(found):
        shared = shapely.area(shapely.intersection(room.buffer(0), np.array(true, np.object_)))
        right[k] = bool(len(true)) and (shared / (room.area + shapely.area(true) - shared)).max() >= SAME_IOU
    return right


def of_member(task: tuple[str, int], seed: int, folder: Path, built: Path | None) -> list[Part]:
    """Return the parts of a made house; every third one is damaged first."""
    kind, number = task
    house = built_member(task, seed, folder, built)
    found: list[Part] = []
    for level, buildings in house.storeys:
        here = of_storey(house.truths, level)
        if here:
            found += parts_of(level, buildings, _of_cases(here), f"{kind} {number}", kind)
    return found


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


def of_file(name: str, folder: Path, built: Path | None) -> list[Part]:
    """Return the parts of a file of the corpus: by what somebody has drawn, or marked, or else by its verdict."""
    file = next(file for file in manifest.load() if file.name == name)
    house = built_file(file, folder, built)
    storeys, (verdict, _) = house.storeys, runs.verdict_of(file, house.outcome)
    truth, group = truths.load(name), f"corpus {file.half}"
    known: list[tuple[Level, Sequence[Building], Known | marks.Marked | bool]] = []
    if truth:
        known = [(*each, _of_drawing(each[0], storey)) for each in storeys for storey in _drawn_of(truth, each[0])]
    elif name in marks.load():
        known = [(*each, marked) for each in storeys for marked in marks.load()[name] if marked.is_of(each[0])]
    elif verdict in {manifest.Verdict.RIGHT, manifest.Verdict.WRONG}:
        known = [(*each, verdict is manifest.Verdict.RIGHT) for each in storeys]
    return [part for level, buildings, told in known for part in parts_of(level, buildings, told, name, group)]


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
    return [s for s in storeys if np.allclose(truths.extent_of(level), s.extent, rtol=truths.SAME, atol=truths.SAME)]


def levels_of(path: Path) -> list[Level]:
    """Return the levels of a file that are no rejections."""
    found = []
    try:
        for item in find(str(path)):
            found += [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    except Rejection:
        pass
    return found


def fit(parts: Sequence[Part], names: Sequence[str], ridge: float = RIDGE) -> LogisticModel:
    """Fit one model by greatest likelihood; a ridge keeps the weights of rare features small."""
    table = np.array([[part.features.get(name, 0.0) for name in names] for part in parts])
    true = np.array([part.true for part in parts])
    weight = weights_of(parts)

    def loss(x: Floats) -> tuple[float, Floats]:
        z = x[0] + table @ x[1:]
        value = (weight * np.logaddexp(0, np.where(true, -z, z))).sum() + ridge * (x[1:] ** 2).sum() / 2
        slope = weight * (1 / (1 + np.exp(-z)) - true)
        return float(value), np.concatenate([[slope.sum()], table.T @ slope + ridge * x[1:]])

    x = minimize(loss, np.zeros(len(names) + 1), jac=True, method="L-BFGS-B", options={"maxiter": 2000}).x
    kept = {name: round(float(w), 2) for name, w in zip(names, x[1:], strict=True) if abs(w) >= 0.05}
    return LogisticModel(round(float(x[0]), 2), kept)


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


def table_of(parts: Sequence[Part], fitted: Mapping[str, LogisticModel]) -> Table:
    """Show how good the models are, a row for each part and group."""
    table = Table(title="Confidence of doors, entrances and rooms")
    for k, heading in enumerate(("part", "of", "n", "true", "mean", "area", "Brier", "calibration error", "by chance")):
        table.add_column(heading, justify="right" if k > 1 else "left")
    for part in PARTS:
        for group in sorted({each.group for each in parts}):
            chosen = [each for each in parts if each.part == part and each.group == group]
            if chosen:
                true = np.array([each.true for each in chosen])
                scores = np.array([fitted[part].confidence(each.features) for each in chosen])
                found = measures(scores, true)
                figures = [f"{x:.2f}" for x in (true.mean(), scores.mean(), *found.values())]
                table.add_row(part, group, str(len(chosen)), *figures)
    return table


def source_of(fitted: Mapping[str, LogisticModel]) -> str:
    """Return the text of ``weights.toml``."""
    lines = ["# Written by python -m research.confidence_fit; see pipeline/stages/confidence.py.", ""]
    for part in PARTS:
        lines += [f"[{part}]", f"bias = {fitted[part].bias}", f"[{part}.weights]"]
        lines += [f"{name} = {weight}" for name, weight in sorted(fitted[part].weights.items())] + [""]
    return "\n".join(lines[:-1]) + "\n"


def collect_parts(
    kinds: Sequence[str], members: int, seed: int, corpus: Path | None, built: Path | None, *, both_halves: bool = False
) -> list[Part]:
    """Return the parts of made houses and of the corpus, of its first half only unless both are asked for.

    ``built`` is where the houses are kept as they were built; None to keep none.
    """
    with tempfile.TemporaryDirectory() as folder:
        tasks = [(kind, number) for number in range(members) for kind in kinds]
        found = in_order(partial(of_member, seed=seed, folder=Path(folder), built=built), tasks)
    if corpus:
        told = {manifest.Verdict.RIGHT, manifest.Verdict.WRONG}
        files = [file for file in manifest.load() if (both_halves or file.half == 1) and file.is_in(corpus)]
        names = [f.name for f in files if truths.load(f.name) or f.name in marks.load() or f.verdict in told]
        found += in_order(partial(of_file, folder=corpus, built=built), names)
    return found


def in_order(function: Callable[[Any], list[Found]], items: Sequence[Any]) -> list[Found]:
    """Return what a function finds in items, in their order; raise HouseExpoError if one of them is lost."""
    results = dict(run(function, items, workers=2, limits=LIMITS))
    lost = [f"{item}: {results[item]}" for item in items if isinstance(results[item], Failure)]
    if lost:
        raise HouseExpoError(f"{len(lost)} of {len(items)} houses gave nothing: {'; '.join(lost)[:500]}")
    return [each for item in items for each in results[item]]


def _doubt_spaces(parts: Sequence[Part], model: LogisticModel) -> list[Part]:
    """Return all parts, the rooms with the doubt of a model whether their spaces are indoors."""
    return [_doubt_space(part, model) if part.part == "room" else part for part in parts]


def _doubt_space(room: Part, model: LogisticModel) -> Part:
    of_space = {name[len(SPACE) :]: np.array([v]) for name, v in room.features.items() if name.startswith(SPACE)}
    doubt = float(model.doubt(of_space)[0]) if of_space else 0.0
    return msgspec.structs.replace(room, features=room.features | {"doubtful_space": doubt})


def _is_of_model(name: str, part: str) -> bool:
    """Whether the model of a part has a feature: doors weigh the grounds of the plan, others its quality (F5)."""
    if name.startswith(SPACE):
        return False
    if name == "doubtful_plan":
        return part in {"entrance", "room"}
    if part == "entrance" and name in OF_ROOM:
        return False
    return part == "door" or not name.startswith("plan_")


def main() -> None:
    """Fit on what is for it, show what comes of it on what was left out, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=6)
    parser.add_argument("--kinds", default=",".join({**KINDS, **RAW}))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--built", type=Path)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--parts", default=",".join(PARTS), help="fit these models only, and keep the others")
    parser.add_argument("--both-halves", action="store_true", help="count the corpus's second half too")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    corpus = given.corpus.absolute() if given.corpus else None
    kinds = given.kinds.split(",")
    parts = collect_parts(kinds, given.members, given.seed, corpus, given.built, both_halves=given.both_halves)
    seen = [part for part in parts if part.group != "corpus 2"]
    console = Console(width=120)
    fitted = dict(load_models())
    for part in [part for part in PARTS if part in given.parts.split(",")]:
        if part == "room":
            parts, seen = (_doubt_spaces(each, fitted["space"]) for each in (parts, seen))
        its = [each for each in seen if each.part == part]
        names = sorted({n for each in its for n, value in each.features.items() if value and _is_of_model(n, part)})
        fitted[part] = fit(its, names)
    console.print(table_of(parts, fitted))
    text = source_of(fitted)
    if given.write:
        WEIGHTS.write_text(text, encoding="utf-8")
    else:
        console.print(text, highlight=False, markup=False)


if __name__ == "__main__":
    main()
