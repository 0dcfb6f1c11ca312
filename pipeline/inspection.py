"""One house, stage by stage, for a person who wants to see what happened and why."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from houseexpo.drawing import contact_sheet
from houseexpo.errors import ConfigError
from pipeline.algorithm import Snapshot, stages
from pipeline.build import list_inputs
from pipeline.config_file import BuildConfig
from pipeline.job import rng_of
from pipeline.pictures import stage_pictures
from pipeline.png import as_png
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.values import Level, RejectedLevel

SHEET = "stages.png"


@dataclass(frozen=True)
class Inspection:
    """What was found: the level's id, the pictures' names in the order of the stages, and why there is no plan."""

    id: str
    pictures: tuple[str, ...]
    rejection: Rejection | None


def inspect_house(config: BuildConfig, number: int, out: Path) -> Inspection:
    """Write a picture of each stage that a house passes, and all of them on one sheet.

    Parameters
    ----------
    config
        Its source is a house; of a source that holds several, the first.
    number
        Which level, counted from the lowest.
    out
        Folder for the pictures; made where it is absent.

    Raises
    ------
    ConfigError
        Where the source is none, or the house has no such level.
    """
    try:
        level = _level(config, number)
    except Rejection as rejection:
        return Inspection(Path(config.build.sources[0]).name, (), rejection)
    snapshots: list[Snapshot] = []
    rejection_: Rejection | None = None
    try:
        snapshots.extend(stages(level, config.stages, rng_of(level, config.build.seed)))
    except Rejection as rejection:
        rejection_ = rejection
    pictures = stage_pictures(snapshots)
    out.mkdir(parents=True, exist_ok=True)
    names = [f"{i:02d}_{name.replace(' ', '_')}.png" for i, (name, _) in enumerate(pictures)]
    for name, (_, image) in zip(names, pictures, strict=True):
        (out / name).write_bytes(as_png(image))
    if pictures:
        titles, images = zip(*pictures, strict=True)
        (out / SHEET).write_bytes(as_png(contact_sheet(images, min(len(images), 5), titles)))
        names.append(SHEET)
    return Inspection(level.id, tuple(names), rejection_)


def _level(config: BuildConfig, number: int) -> Level:
    item = list_inputs(config)[0]
    levels = list(reader(item.reader).read(item))
    if number >= len(levels):
        raise ConfigError(f"{item.id}: level {number} asked for, found {len(levels)}: 0 to {len(levels) - 1}")
    level = levels[number]
    if isinstance(level, RejectedLevel):
        raise level.rejection
    return level
