"""IFC files: storeys become levels; spaces give rooms, names and labels; openings tell doors from mere gaps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from shapely.affinity import translate

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of
from houseexpo.plan import Frame
from pipeline.rejection import Reason, Rejection
from pipeline.sources.ifc_file import Part, load_building
from pipeline.sources.ifc_levels import IfcLevel, storey_levels
from pipeline.sources.naming import base_id, level_id, list_files
from pipeline.sources.placing import Shift, near_shift
from pipeline.values import Input, Level, Mesh, SourceObject, SourceOpening, SourceRoom

SUFFIXES = (".ifc",)


def find(path: str, **options: str) -> Iterator[Input]:
    """List the IFC files at or under a path; IFC says its units and axes itself, so there are no options.

    Raises
    ------
    ConfigError
        Where an option is given.
    Rejection
        MISSING_FILE where the path does not exist.
    """
    if options:
        raise ConfigError(f"IFC files take no option, {', '.join(sorted(options))} given")
    for file, name in list_files(path, SUFFIXES):
        yield Input(base_id(name), "ifc", str(file), options=(("file", name),))


def read(item: Input) -> Iterator[Level]:
    """Yield the storeys of one IFC file that are levels, from the lowest to the highest.

    Raises
    ------
    Rejection
        Where the file cannot be read, or no storey has walls.
    """
    path = Path(item.path)
    building = load_building(path)
    found = storey_levels(building)
    if not found:
        names = ", ".join(storey.name for storey in building.storeys[:8])
        detail = f"{path.name}: no wall of 1.8 m stands on any of its storeys ({names})"
        raise Rejection("source", Reason.NO_LEVEL, detail, "export the walls too, or the building as a mesh")
    shift = near_shift(np.concatenate([level.walls.vertices for level in found]))
    digest = sha256_of(path)
    name = dict(item.options).get("file", path.name)
    for number, level in enumerate(found):
        provenance = {
            "source": "ifc",
            "file": name,
            "sha256": digest,
            "schema": building.schema,
            "storey": level.name,
            "units": "m",
            "up": "z",
        }
        yield _level(level, shift, level_id(item.id, number, len(found)), number, provenance)


def _level(found: IfcLevel, shift: Shift, name: str, number: int, provenance: dict[str, str]) -> Level:
    """Move a level into its own frame: near the origin, the floor at z = 0."""
    x, y = shift[:2]

    def moved(part: Part) -> SourceObject:
        return SourceObject((*part.words, part.kind), Mesh(part.mesh.vertices - (x, y, found.floor_z), part.mesh.faces))

    return Level(
        id=name,
        walls=Mesh(found.walls.vertices - (x, y, found.floor_z), found.walls.faces),
        ceiling_m=found.ceiling_m,
        frame=Frame(((1.0, 0.0, x), (0.0, 1.0, y)), "z", found.floor_z, number),
        floor=found.floor and translate(found.floor, -x, -y),
        below=found.below and translate(found.below, -x, -y),
        leaves=tuple(moved(leaf) for leaf in found.leaves),
        furniture=tuple(moved(thing) for thing in found.furniture),
        rooms=tuple(
            SourceRoom(room.words, room.labels, room.polygon and translate(room.polygon, -x, -y))
            for room in found.rooms
        ),
        room_count=len(found.rooms) or None,
        named_openings=found.named_openings,
        openings=tuple(SourceOpening(translate(each.polygon, -x, -y), each.has_door) for each in found.openings),
        n_objects=len(found.furniture),
        provenance=provenance,
    )
