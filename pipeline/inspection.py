"""One house, stage by stage, for a person who wants to see what happened and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from houseexpo.drawing import contact_sheet
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Quality
from pipeline.algorithm import Snapshot, stages
from pipeline.batch.job import rng_of
from pipeline.batch.listing import list_inputs
from pipeline.config_file import BuildConfig
from pipeline.corrections import corrected_input, corrected_level
from pipeline.overrides import Override
from pipeline.pictures import stage_pictures
from pipeline.png import as_png
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.top_view import top_view
from pipeline.values import Input, Level, RejectedLevel

SHEET = "stages.png"
REJECTED = "rejected.png"


@dataclass(frozen=True)
class Shown:
    """Which level of which house is shown: the level's id and number of how many, the house's id of how many."""

    id: str
    level: int
    levels: int
    house: str
    houses: int

    def __str__(self) -> str:
        house = f"house {self.house}" + (f", the first of {self.houses}" if self.houses > 1 else "")
        return f"{self.id}: {house}; level {self.level} of {self.levels}, counted from 0"


@dataclass(frozen=True)
class Inspection:
    """What was found: what is shown, the pictures' names in the order of the stages, and why there is no plan.

    ``shown`` is None where the house could not be opened; ``quality`` is the plan's, where it says so.
    """

    shown: Shown | None
    pictures: tuple[str, ...]
    rejection: Rejection | None
    quality: Quality | None = None


def inspect_house(config: BuildConfig, overrides: Mapping[str, Override], number: int, out: Path) -> Inspection:
    """Write a picture of each stage that a house passes, and all of them on one sheet.

    Parameters
    ----------
    config, overrides
        Its source is a house; of a source that holds several, the first. A person's word counts as in a build.
    number
        Which level, counted from the lowest.
    out
        Folder for the pictures; made where it is absent.

    Raises
    ------
    ConfigError
        Where the source is none, or the house has no such level.
    """
    inputs = list(list_inputs(config))
    item = corrected_input(inputs[0], overrides)
    out.mkdir(parents=True, exist_ok=True)
    try:
        level, levels = _level(item, number)
    except Rejection as rejection:
        return Inspection(None, _picture_of(rejection, out), rejection)
    shown = Shown(level.id, number, levels, item.id, len(inputs))
    if isinstance(level, RejectedLevel):
        return Inspection(shown, _picture_of(level.rejection, out), level.rejection)
    override = overrides.get(level.id, Override())
    level = corrected_level(level, override)
    snapshots: list[Snapshot] = []
    rejection_: Rejection | None = None
    try:
        snapshots.extend(stages(level, override.applied(config.planning), rng_of(level, config.build.seed)))
    except Rejection as rejection:
        rejection_ = rejection
    if rejection_ is not None and not snapshots:
        return Inspection(shown, _picture_of(rejection_.pictured(top_view(level.walls)), out), rejection_)
    snapshots = _of_one_building(snapshots, level.id)
    plans = [snapshot.value for snapshot in snapshots if isinstance(snapshot.value, FloorPlan)]
    return Inspection(shown, _write(snapshots, level, out), rejection_, plans[0].quality if plans else None)


def _of_one_building(snapshots: list[Snapshot], level_id: str) -> list[Snapshot]:
    """The steps of the whole level, and of the largest of its buildings."""
    plans = [snapshot for snapshot in snapshots if isinstance(snapshot.value, FloorPlan)]
    largest = max(plans, key=lambda snapshot: snapshot.value.area).id if plans else level_id  # type: ignore[union-attr]
    return [snapshot for snapshot in snapshots if snapshot.id in {level_id, largest}]


def _level(item: Input, number: int) -> tuple[Level | RejectedLevel, int]:
    """Return a level and how many there are."""
    levels = list(reader(item.reader).read(item))
    if number >= len(levels):
        raise ConfigError(f"{item.id}: level {number} asked for, found {len(levels)}: 0 to {len(levels) - 1}")
    return levels[number], len(levels)


def _write(snapshots: list[Snapshot], level: Level, out: Path) -> tuple[str, ...]:
    pictures = stage_pictures(snapshots, level.frame)
    names = [f"{i:02d}_{name.replace(' ', '_')}.png" for i, (name, _) in enumerate(pictures)]
    for name, (_, image) in zip(names, pictures, strict=True):
        (out / name).write_bytes(as_png(image))
    titles, images = zip(*pictures, strict=True)
    (out / SHEET).write_bytes(as_png(contact_sheet(images, min(len(images), 5), titles)))
    return (*names, SHEET)


def _picture_of(rejection: Rejection, out: Path) -> tuple[str, ...]:
    """Write what the reader shows of a house that it rejects."""
    if not rejection.picture:
        return ()
    (out / REJECTED).write_bytes(rejection.picture)
    return (REJECTED,)
