"""Build made houses and files of the corpus, and keep what the stages found, so that several fits use the same builds.

A house is kept in a folder, as one pickled file under its name. A run that was cut off goes on where it ended. Nothing
tells that the program has changed since: delete the folder after a change of ``pipeline/sources``, ``geometry`` or
``stages``. New weights and new features need no new build.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.stages.confidence import FinalBuilding
from pipeline.stages.quality_grounds import measure_quality_grounds
from pipeline.stages.room_doubt import doubt_spaces
from pipeline.stages.rooms import name_rooms
from pipeline.values import Evidence, Layout, Level, RejectedLevel, Spaces
from tests.builders.judged import damage_of
from tests.builders.kinds.registry import make_member
from tests.builders.shared import as_json
from tests.corpus import runs
from tests.corpus.manifest import File, checkout


@dataclass(frozen=True, eq=False)
class Building:
    """What the stages found of a building, and its plan."""

    evidence: Evidence
    layout: Layout
    spaces: Spaces
    plan: FloorPlan

    def rated(self, level: Level) -> FinalBuilding:
        """Return what confidences are measured on; how doubtful its spaces are is told by the models of today."""
        doubts = doubt_spaces(level, self.evidence, self.layout)
        grounds = measure_quality_grounds(level, self.evidence, self.layout, self.spaces, doubts=doubts)
        named = name_rooms(level, self.spaces)
        return FinalBuilding(level, self.evidence, self.layout, self.spaces, named, grounds, doubts)


@dataclass(frozen=True, eq=False)
class BuiltHouse:
    """The storeys of a house that could be read, with their buildings; ``rejected`` names stage and reason of others.

    ``truths`` are those of a made house, one for each of its storeys.
    """

    storeys: tuple[tuple[Level, tuple[Building, ...]], ...]
    rejected: tuple[str, ...]
    truths: tuple[dict[str, Any], ...] = ()

    @property
    def outcome(self) -> runs.Outcome:
        """What came of it, as the corpus records it, but for the plans' quality."""
        plans = [as_json(building.plan) for _, buildings in self.storeys for building in buildings]
        return runs.Outcome([runs.figures_of_plan("", plan) for plan in plans], list(self.rejected))


def built_member(task: tuple[str, int], seed: int, folder: Path, kept: Path | None) -> BuiltHouse:
    """Return a member of a kind, built; every third one is damaged first. Its file is written into ``folder``."""

    def build() -> BuiltHouse:
        kind, number = task
        member = make_member(kind, number, seed, folder / kind)
        return _build(member.path, change=damage_of(kind, number, seed), truths=member.truths)

    return _keep(f"made {task[0]} {task[1]} {seed}", kept, build)


def built_file(file: File, checkouts: Path, kept: Path | None) -> BuiltHouse:
    """Return a file of the corpus, built as a user would build it."""
    models = os.pathsep.join(str(checkout(checkouts, file.repository) / model) for model in file.models)
    return _keep(f"corpus {file.key}", kept, lambda: _build(file.place(checkouts), model_path=models))


def built_path(path: Path, kept: Path | None) -> BuiltHouse:
    """Return a file that somebody has reviewed, built without their corrections: these are what is known of it."""
    return _keep(f"reviewed {hashlib.sha256(os.fsencode(path)).hexdigest()[:16]}", kept, lambda: _build(path))


def _keep(name: str, folder: Path | None, build: Callable[[], BuiltHouse]) -> BuiltHouse:
    if folder is None:
        return build()
    place = folder / f"{name}.pickle"
    if place.exists():
        found = pickle.loads(place.read_bytes())  # noqa: S301 - written by this very function
        assert isinstance(found, BuiltHouse)
        return found
    house = build()
    folder.mkdir(parents=True, exist_ok=True)
    part = place.with_suffix(".part")
    part.write_bytes(pickle.dumps(house))
    part.replace(place)
    return house


def _build(
    path: Path,
    *,
    model_path: str = "",
    change: Callable[[Level], Level] | None = None,
    truths: tuple[dict[str, Any], ...] = (),
) -> BuiltHouse:
    """Build all storeys of a file; ``change`` is done to each of them first."""
    storeys: list[tuple[Level, tuple[Building, ...]]] = []
    rejected: list[str] = []
    try:
        for level in _levels(path, model_path):
            if isinstance(level, RejectedLevel):
                rejected.append(_line(level.rejection))
            else:
                changed = change(level) if change else level
                storeys.append((changed, _buildings(changed, rejected)))
    except Rejection as rejection:
        rejected.append(_line(rejection))
    except ConfigError:
        rejected.append("refused")
    return BuiltHouse(tuple(storeys), tuple(sorted(rejected)), truths)


def _levels(path: Path, model_path: str) -> Iterator[Level | RejectedLevel]:
    for item in find(str(path), **({"model_path": model_path} if model_path else {})):
        yield from reader(item.reader).read(item)


def _buildings(level: Level, rejected: list[str]) -> tuple[Building, ...]:
    """Return the buildings of a level that became plans; the others are added to ``rejected``."""
    evidence = layout = spaces = None
    found: list[Building] = []
    try:
        for result in run_stages(level, PipelineConfig(), np.random.default_rng(0)):
            match result.value:
                case Evidence():
                    evidence = result.value
                case Layout():
                    layout = result.value
                case Spaces():
                    spaces = result.value
                case RejectedLevel():
                    rejected.append(_line(result.value.rejection))
                case FloorPlan() if evidence and layout and spaces:
                    found.append(Building(evidence, layout, spaces, result.value))
    except Rejection as rejection:
        rejected.append(_line(rejection))
    return tuple(found)


def _line(rejection: Rejection) -> str:
    return f"{rejection.stage}: {rejection.reason}"
