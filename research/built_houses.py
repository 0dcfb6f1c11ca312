"""Build made houses and files of the corpus, and keep what the stages found, so that several fits use the same builds.

A house is kept in a folder, as one pickled file under its name. A run that was cut off goes on where it ended. Nothing
tells that the program has changed since: delete the folder after a change of ``pipeline/sources``, ``geometry`` or
``stages``. New weights and new features need no new build.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from houseexpo.errors import ConfigError
from pipeline.config import PipelineConfig
from pipeline.fitting.rows import PlannedBuilding, buildings_of
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level, RejectedLevel
from tests.builders.judged import damage_of
from tests.builders.kinds.registry import make_member
from tests.builders.shared import as_json
from tests.corpus import runs
from tests.corpus.manifest import File, checkout


@dataclass(frozen=True, eq=False)
class BuiltHouse:
    """The storeys of a house that could be read, with their buildings; ``rejected`` names stage and reason of others.

    ``truths`` are those of a made house, one for each of its storeys.
    """

    storeys: tuple[tuple[Level, tuple[PlannedBuilding, ...]], ...]
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
    storeys: list[tuple[Level, tuple[PlannedBuilding, ...]]] = []
    rejected: list[str] = []
    try:
        for level in _levels(path, model_path):
            if isinstance(level, RejectedLevel):
                rejected.append(_line(level.rejection))
            else:
                changed = change(level) if change else level
                buildings, why = buildings_of(changed, PipelineConfig())
                storeys.append((changed, tuple(buildings)))
                rejected += map(_line, why)
    except Rejection as rejection:
        rejected.append(_line(rejection))
    except ConfigError:
        rejected.append("refused")
    return BuiltHouse(tuple(storeys), tuple(sorted(rejected)), truths)


def _levels(path: Path, model_path: str) -> Iterator[Level | RejectedLevel]:
    for item in find(str(path), **({"model_path": model_path} if model_path else {})):
        yield from reader(item.reader).read(item)


def _line(rejection: Rejection) -> str:
    return f"{rejection.stage}: {rejection.reason}"
