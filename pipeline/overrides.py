"""Read people's corrections of single houses from ``overrides.toml``, one table for each id, and apply them.

A build reads up to two such files. One is named by ``--overrides``, or else lies beside the manifest. The other lies in
the data set itself; reviews write to it. If the two contradict each other, the one in the data set takes precedence,
because its author saw the result of the other.

::

    [villa_L1]
    keep = true            # keep the plan, even if it is a duplicate or a rule rejects it
    door = [[2.0, 3.1], [2.0, 4.0]]   # a door, from jamb to jamb; for several, a list of these
    no_room = [5.5, 1.0]   # the region around this point is no room; for several, a list of these
    label = [1.0, 1.0, "Kitchen"]     # the other words of a storey are in ``houseexpo.corrections.vocabulary``
    [fair_hall]
    drop = true
    why = "an exhibition hall"
    [old_barn]
    h_g = 0.4              # cut at these heights, metres above the floor
    h_d = 1.1
    [doll_house]           # of a whole file, under the id that the file has without a level
    scale = 20.0           # the model is 1:20
    up = "z"               # its vertical axis, and the unit of its lengths
    units = "cm"
    drop_nodes = ["Lamp*", "Car"]     # leave these nodes, groups and materials out
    wall_layers = ["8-4"]  # the lines of these layers of a DXF file are walls

Points are in metres along the source's plan axes, after units and scale: (X, Y) of a z-up source, (X, Z) of a y-up one.
A plan's ``frame`` converts to them. They remain valid when a plan changes. ``houseexpo inspect`` writes these
coordinates on the edges of its picture of the evidence.
"""

from __future__ import annotations

import difflib
import json
import logging
import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from houseexpo.configuration import config_from_mapping, name_in_config_errors, read_toml
from houseexpo.corrections.decision_log import DecisionLog
from houseexpo.corrections.vocabulary import (
    FILE_WORDS,
    NAME,
    WORDS,
    Override,
    author_key,
    checked_distance,
    checked_values,
)
from houseexpo.dataset.manifest import is_bundled_manifest
from houseexpo.dataset.store.folders import overrides_path
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Frame
from houseexpo.plan.ids import is_of_input, parts_of
from pipeline.config import PipelineConfig
from pipeline.config_file import convert_to_type
from pipeline.geometry.meshes import NO_MESH
from pipeline.rejection import Reason, Rejection
from pipeline.sources import OVERRIDABLE
from pipeline.sources.files import slug
from pipeline.sources.meshes.formats import frame_convention
from pipeline.sources.tolerances import USUAL_STOREY_M
from pipeline.values import IDLE, Input, Level

_LOG = logging.getLogger(__name__)


def find_overrides_file(manifest: Path) -> Path | None:
    """Return the overrides beside a manifest, ``houses.overrides.toml`` for ``houses.toml``; else ``NAME``.

    A folder may hold several manifests, and an id that belongs to no input of a build is an error. A manifest that
    comes with the project has its own overrides or None, so nobody's decisions go into the installed package.
    """
    own = manifest.with_name(f"{manifest.stem}.{NAME}")
    if own.exists():
        return own
    return None if is_bundled_manifest(manifest) else manifest.with_name(NAME)


def load_overrides(
    manifest: Path | None, file: Path | None = None, data_set: Path | None = None
) -> Mapping[str, Override]:
    """Read the corrections by id; return none if there is no file.

    Parameters
    ----------
    manifest
        The overrides beside it are read, unless ``file`` is given.
    file
        A file of overrides, which must exist.
    data_set
        The folder of a data set; the overrides in it are read as well, and take precedence.

    Raises
    ------
    ConfigError
        A file cannot be read, a key is unknown, a value has the wrong type or is out of range, two values contradict
        each other, or the file in the data set is a link.
    """
    named = file or (None if manifest is None else find_overrides_file(manifest))
    if named is not None and (file is not None or named.exists()):
        first = _read(named)
    else:
        named, first = None, {}
    own = overrides_path(data_set) if data_set is not None and data_set.is_dir() else None
    if own is None or (named is not None and own.exists() and own.samefile(named)):
        return first
    if own.is_symlink():
        raise ConfigError(f"{own}: expected a file, found a link, which is not followed; name it with --overrides")
    second = _read(own) if own.is_file() else {}
    for name in sorted(set(first) & set(second)):
        if (first[name].keep, first[name].drop) == (second[name].drop, second[name].keep) != (False, False):
            said = "drop" if second[name].drop else "keep"
            _LOG.warning("%s: %s and %s contradict each other; %s counts: %s", name, named, own, own, said)
    return {
        name: first.get(name, Override()).joined(second.get(name, Override())) for name in sorted({*first, *second})
    }


def _with_authors(overrides: Mapping[str, Override], path: Path) -> Mapping[str, Override]:
    """Return overrides with who said what, and when, as far as the log of a review beside them tells."""
    log = DecisionLog(path.with_suffix(".log.jsonl"))
    if log.path.is_symlink() or not log.path.is_file():
        return overrides
    log.catch_up()
    said = log.authors()
    return {
        name: replace(each, authors=tuple((key, *who) for key, who in sorted(said.get(name, {}).items())))
        for name, each in overrides.items()
    }


def _read(path: Path) -> Mapping[str, Override]:
    return _with_authors({name: _override(name, table, path) for name, table in sorted(read_toml(path).items())}, path)


def _override(name: str, table: Any, path: Path) -> Override:
    """Return the table of an id, checked; errors name the file and the id."""
    if isinstance(table, Mapping):
        if "authors" in table:
            raise ConfigError(f"{path}: {name}.authors: unknown key; the log of a review says who said what")
        try:
            for word in sorted(WORDS.keys() & table.keys()):
                table = {**table, word: checked_values(word, table[word])}
            if "distance" in table:
                table = {**table, "distance": checked_distance(table["distance"])}
        except ConfigError as error:
            raise ConfigError(f"{path}: {name}.{error}") from None
    with name_in_config_errors(path):
        try:
            return config_from_mapping(Override, table, name, convert=_convert_value)
        except ConfigError as error:
            text = str(error)
            raise ConfigError(text if name in text else f"{name}: {text}") from None


def _convert_value(value: Any, hint: Any, key: str) -> Any:
    """Return a value converted to its type; those of words and distances are checked already."""
    return tuple(value) if key.rpartition(".")[2] in {*WORDS, "distance"} else convert_to_type(value, hint, key)


# Apply overrides: find the inputs that they belong to, inform the reader, and change the level.
#
# R1  An id in ``overrides.toml`` is that of an input, or of a building (``_B2``) or a level (``_L1``) of one; eight
#     digits of a hash may follow.
# R2  ``FILE_WORDS`` (its axis, its size, its floors, its nodes) concern a whole file: they stand under the input's own
#     id, and its reader must take them. ``keep`` and ``drop`` under it are of all its storeys.
# R3  What is said of a storey goes with its level, and is applied to the finished plan (``stages.corrections``).
# R4  What is said under the id of a building goes with its level, too, and belongs to this building, if the level has
#     it (``stages.corrections``, R2). An id that no level has is refused once the levels are known.
# R5  A file alone has another id than in its folder (docs/format.md, "Ids"). Corrections written for one are right for
#     the other: an id that is the end of one file's path, from a folder's name on or its own, means that file.


def settle_override_ids(overrides: Mapping[str, Override], inputs: Iterable[Input]) -> Mapping[str, Override]:
    """Return the overrides under the ids of a build's inputs, where they were written for another source (R5)."""
    listed = list(inputs) if overrides else []
    known = {item.id for item in listed}
    whole = [(item, slug(Path(item.path).absolute().with_suffix("").as_posix())) for item in listed if not item.key]
    found: dict[str, Override] = {}
    for name, override in overrides.items():
        own = name
        if known.isdisjoint(_inputs_of(name)):
            meant = {
                item.id + name[len(base) :]
                for base in _inputs_of(name)
                for item, path in whole
                if f"_{path}".endswith(f"_{base}") and f"_{base}".endswith(f"_{slug(Path(item.path).stem)}")
            }
            own = meant.pop() if len(meant) == 1 else name
        found[own] = found[own].joined(override) if own in found else override
    return found


def check_override_ids(overrides: Mapping[str, Override], inputs: Iterable[Input]) -> None:
    """Refuse overrides whose id no house has.

    Raises
    ------
    ConfigError
        An id belongs to no house; the message names the nearest one.
    """
    ids = [item.id for item in inputs]
    known = set(ids)
    for name in overrides:
        if known.isdisjoint(_inputs_of(name)):
            near = difflib.get_close_matches(name, ids, n=1, cutoff=0.0)
            hint = f"did you mean {near[0]!r}?" if near else "the build has no inputs"
            raise ConfigError(f"corrections: {name}: expected an id of this build, found no such input; {hint}")


def overrides_by_input(overrides: Mapping[str, Override]) -> Mapping[str, Mapping[str, Override]]:
    """Return the overrides of each input, by the input's id."""
    found: dict[str, dict[str, Override]] = {}
    for name in sorted(overrides):
        for known in _inputs_of(name):
            found.setdefault(known, {})[name] = overrides[name]
    return found


def correct_input(item: Input, overrides: Mapping[str, Override]) -> Input:
    """Return the input with the overrides that its reader needs, added as options.

    Raises
    ------
    ConfigError
        The overrides break R2.
    """
    for name, override in overrides.items():
        if override.of_file and name != item.id and is_of_input(name, item.id):
            raise ConfigError(
                f"corrections: {name}: {', '.join(FILE_WORDS[:-1])} and {FILE_WORDS[-1]} are of a whole file; put them "
                f"under [{item.id}]"
            )
    if item.id not in overrides:
        return item
    override, taken = overrides[item.id], OVERRIDABLE.get(item.reader, ())
    options = {key: value for key, value in _as_options(override).items() if value}
    if unknown := sorted(set(options) - set(taken)):
        raise ConfigError(f"corrections: {item.id}: its reader, {item.reader}, takes no {unknown[0]}; take it out")
    if override.keep and "keep" in taken:
        options["keep"] = "true"
    given = dict(item.options)
    if override.distance or override.storey_height or options.keys() & {"units", "scale"}:
        said = {"storey_height"} if override.units or override.scale else {"storey_height", "units", "scale"}
        given = {key: value for key, value in given.items() if key not in said}  # it says the size in their place
    return replace(item, options=tuple(sorted({**given, **options}.items())))


def _as_options(override: Override) -> dict[str, str | None]:
    """Return what an override says of a whole file, as options of its reader; a known distance gives the units."""
    units = override.units
    if override.distance is not None:
        a, b, metres = override.distance
        units = repr(metres / math.dist(a, b))
    return {
        "up": override.up,
        "units": units,
        "scale": repr(override.scale) if override.scale else None,
        "storey_height": repr(override.storey_height) if override.storey_height else None,
        "floors": json.dumps(override.floors) if override.floors else "",
        "drop_nodes": json.dumps(override.drop_nodes) if override.drop_nodes else "",
        "wall_layers": json.dumps(override.wall_layers) if override.wall_layers else "",
    }


_KEEP: Final = author_key("keep", True)  # the value that the file has


@dataclass(frozen=True)
class LevelOverride:
    """What people say of a level and its buildings.

    ``own`` is said under the id of the level, of its buildings (R4), or of its file (``keep`` and ``drop``; where they
    contradict each other, the level counts). ``by_id`` is all that is said of its input.
    """

    own: Override
    by_id: Mapping[str, Override]

    @classmethod
    def of(cls, level_id: str, overrides: Mapping[str, Override], sha256: str) -> LevelOverride:
        """Find what is said of a level among what is said of its input.

        ``sha256`` is of the level's content. What is said under an id with its first digits, which tell inputs of equal
        ids apart, is said under the id itself (R1).
        """
        mark = f"_{sha256[:8]}" if sha256 else ""
        by_id = {name: each for name, each in overrides.items() if not mark or not name.endswith(mark)}
        for name in sorted(set(overrides) - set(by_id)):
            short = name.removesuffix(mark)
            by_id[short] = by_id.get(short, Override()).joined(overrides[name])
        own = by_id.get(level_id, Override())
        for name in sorted(set(by_id) - {level_id}):
            override, level = by_id[name], parts_of(name).of_level
            if level == level_id:  # of a building, whose keeping is not its level's
                who = tuple(each for each in override.authors if each[0] != _KEEP)
                own = own.joined(Override(**{word: getattr(override, word) for word in WORDS}, authors=who))
            elif is_of_input(level_id, level):
                of_file = Override(keep=override.keep, drop=override.drop, why=override.why, authors=override.authors)
                own = of_file.joined(own)
        return cls(own, by_id)

    def of_building(self, plan_id: str) -> Override:
        """Return what is said of a building: whether to keep it is said of its level, too."""
        return Override(keep=self.own.keep).joined(self.by_id.get(plan_id, Override()))

    def named(self, plan: FloorPlan) -> FloorPlan:
        """Return a plan whose provenance names who said each of its corrections, and who kept it, if a log told it."""
        authors = (*self.own.authors, *self.by_id.get(plan.id, Override()).authors)
        who = {key: (by, at) for key, by, at in authors}
        told = plan.provenance or {}
        if not who:
            return plan
        named = []
        for record in told.get("corrections", []):
            by = who.get(author_key(record["word"], record["value"]))
            named.append(record if by is None else {**record, "by": by[0], "at": by[1]})
        kept = who.get(_KEEP)
        more: dict[str, Any] = {"corrections": named} if named else {}
        more |= {} if kept is None else {"kept_by": kept[0], "kept_at": kept[1]}
        return replace(plan, provenance={**told, **more}) if more else plan


def check_not_dropped(override: Override) -> None:
    """Raise Rejection where a person says that there is to be no plan."""
    if override.drop:
        why = override.why or "no reason given"
        raise Rejection("overrides", Reason.DROPPED_BY_HAND, why, "see overrides.toml")


def configure(config: PipelineConfig, override: Override) -> PipelineConfig:
    """Return the configuration with the heights given, and without the rule that a person overrules by keep."""
    ground = config.planes.ground_m if override.h_g is None else override.h_g
    door = config.planes.door_m if override.h_d is None else override.h_d
    planes = replace(config.planes, ground_m=ground, door_m=door)
    characters = config.layout.characters and not override.keep
    return replace(config, planes=planes, layout=replace(config.layout, characters=characters))


def ids_without_level(overrides: Mapping[str, Override], levels: Collection[str]) -> list[str]:
    """Return the overridden ids of an input that belong to none of its levels."""
    found = []
    for name in sorted(overrides):
        level = parts_of(name).of_level
        known = {level, parts_of(level).without_digits} & set(levels)
        override = overrides[name]
        of_file = any(is_of_input(each, level) for each in levels)  # R2
        if not known and (override.corrections or _says_heights(override) or (_decides(override) and not of_file)):
            found.append(name)
    return found


def _says_heights(override: Override) -> bool:
    return override.h_g is not None or override.h_d is not None


def _decides(override: Override) -> bool:
    return override.keep or override.drop


def correct_level(level: Level, said: LevelOverride) -> Level:
    """Return the level with what people say of its storey and under which ids (R3, R4), and what does nothing here."""
    heights = () if level.sills else [word for word in ("h_g", "h_d") if getattr(said.own, word) is not None]
    words = {name: {*each.corrections} for name, each in said.by_id.items() if parts_of(name).of_level == level.id}
    own = [replace(each, said_of=tuple(name for name in words if each in words[name])) for each in said.own.corrections]
    idle = [f"{word}: only houses in SUNCG's layout are cut at such a height" for word in heights]
    told = {**level.provenance, IDLE: [*level.provenance.get(IDLE, ()), *idle]} if idle else level.provenance
    return replace(level, corrections=(*level.corrections, *own), provenance=told)


def level_without_walls(item: Input, override: Override, sha256: str) -> Level:
    """Return the level of an input in which no rooms are found: nothing stands in it but what a person says.

    Its axes are those of the source, metres. ``sha256`` is of the input's content, "" if it is not known.
    """
    path, options = Path(item.path), dict(item.options)
    up = override.up or (frame_convention(path).up if item.reader == "mesh_file" else "z")
    frame = Frame(((1.0, 0.0, 0.0), (0.0, 1.0 if up == "z" else -1.0, 0.0)), "z" if up == "z" else "y", 0.0, 0)
    provenance = {"source": item.reader, "file": options.get("file", path.name)}
    provenance |= {"sha256": sha256} if sha256 else {}
    return Level(item.id, NO_MESH, USUAL_STOREY_M, frame, provenance=provenance)


def outcomes_of_corrections(override: Override, plans: Iterable[FloorPlan]) -> list[tuple[str, str]]:
    """Return what became of each correction (``done``, ``already`` or ``none``) and a sentence, by provenance of plans.

    A correction of a storey with several buildings did something if it did in one of them.
    """
    found: dict[str, tuple[str, str]] = {}
    idle: dict[str, None] = {}
    for plan in plans:
        provenance = plan.provenance or {}
        idle |= dict.fromkeys(provenance.get(IDLE, ()))
        for told in provenance.get("corrections", []):
            key = json.dumps([told["word"], told["value"]])
            if found.get(key, ("none", ""))[0] == "none":
                found[key] = told["outcome"], told["said"]
    wanted = {json.dumps([each.word, each.plain_value]): str(each) for each in override.corrections}
    outcomes = [(outcome, f"{wanted[key]}: {said}") for key, (outcome, said) in found.items() if key in wanted]
    return outcomes + [("none", sentence) for sentence in idle]


def _inputs_of(name: str) -> list[str]:
    """Return the ids of all inputs that a name concerns, whether there are such inputs or not."""
    starts = [name[: mark.start()] for mark in re.finditer("_", name)]
    return [known for known in (*starts, name) if is_of_input(name, known)]
