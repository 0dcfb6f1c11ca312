"""Run one house through the stages for ``houseexpo inspect``: write a PNG of each, return the plan or the rejection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from houseexpo.files import make_folder
from houseexpo.floorplan import FloorPlan
from houseexpo.outputs import CommandOutput
from houseexpo.plan import Quality
from houseexpo.plan.ids import is_of_input, parts_of
from houseexpo.progress import show_progress
from houseexpo.words import unknown_name_message
from pipeline.algorithm import StageResult, run_stages
from pipeline.batch.job import level_rng
from pipeline.batch.listing import list_inputs
from pipeline.config_file import BuildConfig
from pipeline.geometry.areas import ignore_division_warnings
from pipeline.overrides import (
    LevelOverride,
    configure,
    correct_input,
    correct_level,
    settle_override_ids,
)
from pipeline.pictures import compose_sheet, results_of_building, stage_pictures
from pipeline.png import draw_top_view, encode_png
from pipeline.rejection import Rejection
from pipeline.sources import is_path, reader
from pipeline.values import Input, Level, RejectedLevel

SHEET = "stages.png"
REJECTED = "rejected.png"


@dataclass(frozen=True)
class InspectedLevel:
    """Which level of which house is shown: the id and number of the level and of the house, and of how many.

    ``corrected`` are the ids for which corrections by hand were given.
    """

    id: str
    level: int
    levels: int
    house: str
    number: int
    houses: int
    corrected: tuple[str, ...] = ()

    def __str__(self) -> str:
        house = f"; house {self.number + 1} of {self.houses}: {self.house}" if self.houses > 1 else ""
        level = f"level {self.level} of {self.levels}, the lowest is 0" if self.levels > 1 else "the only level"
        return f"{self.id}: {level}{house}"


@dataclass(frozen=True)
class Inspection:
    """What was found: what is shown, the pictures' names in the order of the stages, and why there is no plan.

    ``shown`` is None if the house could not be opened; ``plan`` is the first building's.
    """

    shown: InspectedLevel | None
    pictures: tuple[str, ...]
    rejection: Rejection | None
    plan: FloorPlan | None = None

    @property
    def quality(self) -> Quality | None:
        """The plan's quality, if it has one."""
        return None if self.plan is None else self.plan.quality


@ignore_division_warnings()
def inspect_house(
    config: BuildConfig,
    overrides: Mapping[str, Override],
    number: int,
    out: Path,
    name: str | None = None,
    *,
    replace: bool = False,
) -> Inspection:
    """Write a picture of each stage that a house passes, and all of them on one sheet.

    Parameters
    ----------
    config, overrides
        Its source is a house, or holds several. A person's word counts as in a build.
    number
        Which level, counted from the lowest.
    out
        Folder for the pictures; made where it is absent.
    name
        Id of the house, or of one of its levels; the first house of the source by default.
    replace
        Whether files of the same names are written over that houseexpo did not write.

    Raises
    ------
    ConfigError
        Where the source is none, has no house of that id, or the house has no such level; where a file is there that is
        not to be written over.
    """
    sources = [source for source in config.build.sources if is_path(source)]
    with CommandOutput(out, sources, replace=replace, folder=True) as output:
        return _inspect_input(config, overrides, number, name, output)


def _inspect_input(
    config: BuildConfig, overrides: Mapping[str, Override], number: int, name: str | None, output: CommandOutput
) -> Inspection:
    inputs = list(list_inputs(config))
    place = _find_input(inputs, name)
    overrides = settle_override_ids(overrides, inputs)
    item = correct_input(inputs[place], overrides)
    make_folder(output.out)
    try:
        levels = list(show_progress(reader(item.reader).read(item), f"reading {item.id}"))
    except Rejection as rejection:
        return Inspection(None, _picture_of(rejection, output), rejection)
    number = _number(item, levels, number, name)
    level = levels[number]
    shown = InspectedLevel(level.id, number, len(levels), item.id, place, len(inputs), tuple(overrides))
    if isinstance(level, RejectedLevel):
        return Inspection(shown, _picture_of(level.rejection, output), level.rejection)
    said = LevelOverride.of(level.id, overrides, level.content)
    level, override = correct_level(level, said), said.own
    results: list[StageResult] = []
    rejection_: Rejection | None = None
    try:
        found = run_stages(level, configure(config.planning, override), level_rng(level, config.build.seed))
        results.extend(show_progress(found, f"planning {level.id}"))
    except Rejection as rejection:
        rejection_ = rejection
    if rejection_ is not None and not results:
        return Inspection(shown, _picture_of(rejection_.with_picture(draw_top_view(level.walls)), output), rejection_)
    results = _of_one_building(results, level.id)
    plans = [result.value for result in results if isinstance(result.value, FloorPlan)]
    return Inspection(shown, _write(results, level, output), rejection_, plans[0] if plans else None)


def _of_one_building(results: list[StageResult], level_id: str) -> list[StageResult]:
    """Return the steps of the whole level, and of the largest of its buildings."""
    plans = [result for result in results if isinstance(result.value, FloorPlan)]
    largest = max(plans, key=lambda result: result.value.area).id if plans else level_id  # type: ignore[union-attr]
    return results_of_building(results, level_id, largest)


def _find_input(inputs: Sequence[Input], name: str | None) -> int:
    """Return which of the inputs has this id, or a level or building of this id."""
    if name is None:
        return 0
    ids = [item.id for item in inputs]
    found = [place for place, known in enumerate(ids) if is_of_input(name, known)]
    if not found:
        raise ConfigError(f"--id: {unknown_name_message(name, ids)}")
    return max(found, key=lambda place: len(ids[place]))


def _number(item: Input, levels: Sequence[Level | RejectedLevel], number: int, name: str | None) -> int:
    """Return the level that is meant, by its id or by its number."""
    wanted = {name, parts_of(name or "").of_level} - {item.id}
    number = next((place for place, level in enumerate(levels) if level.id in wanted), number)
    if number >= len(levels):
        raise ConfigError(f"{item.id}: level {number} asked for, found {len(levels)}: 0 to {len(levels) - 1}")
    return number


def _write(results: list[StageResult], level: Level, output: CommandOutput) -> tuple[str, ...]:
    pictures = stage_pictures(results, level.frame)
    names = [f"{i:02d}_{name.replace(' ', '_')}.png" for i, (name, _) in enumerate(pictures)]
    for name, (_, image) in zip(names, pictures, strict=True):
        output.write(output.out / name, encode_png(image))
    output.write(output.out / SHEET, compose_sheet(results, level.frame))
    return (*names, SHEET)


def _picture_of(rejection: Rejection, output: CommandOutput) -> tuple[str, ...]:
    """Write what the reader shows of a house that it rejects."""
    if not rejection.picture:
        return ()
    output.write(output.out / REJECTED, rejection.picture)
    return (REJECTED,)
