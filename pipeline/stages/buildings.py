"""Split a level into one level with its spaces for each building, so that no cut connects two buildings.

R1  Parts of a level whose outlines stand within ``distance_m`` of each other are one building; but not those that each
    have an entrance of their own, and air between them that no wall is thick enough to fill.
R2  Buildings are numbered by place, from the least x and then the least y; the number stands in the id before the
    level's (``_B1``).
"""

from __future__ import annotations

import re
from dataclasses import replace

import networkx as nx
import shapely

from pipeline.config import IsolatedConfig
from pipeline.tolerances import AROUND_M, SHEET_M
from pipeline.values import Level, SourceRoom, Spaces


def separate_buildings(level: Level, spaces: Spaces, config: IsolatedConfig) -> list[tuple[Level, Spaces]]:
    """Return each building as a level with its spaces. A level with one building is returned as it is."""
    outlines = list(spaces.outlines)
    near = nx.Graph()
    near.add_nodes_from(range(len(outlines)))
    pairs = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=config.distance_m).T
    entered = _outlines_with_entrance(spaces)
    near.add_edges_from(
        (a, b)
        for a, b in pairs.tolist()
        if not (a in entered and b in entered and outlines[a].distance(outlines[b]) > AROUND_M)
    )
    groups = [sorted(group) for group in nx.connected_components(near)]  # R1
    if len(groups) < 2:
        return [(level, spaces)]
    groups.sort(key=lambda group: min(outlines[k].bounds[:2] for k in group))  # R2
    found = []
    for number, group in enumerate(groups, start=1):
        inside = [
            k
            for k, room in enumerate(spaces.rooms)
            if any(outlines[g].contains(room.representative_point()) for g in group)
        ]
        if not inside:
            continue
        part = replace(spaces.keeping(inside), outlines=tuple(outlines[k] for k in group))
        rooms = tuple(room for room in level.rooms if _lies_in(room, part))
        count = len(rooms) if level.room_count is not None else None
        found.append((replace(level, id=building_id(level.id, number), rooms=rooms, room_count=count), part))
    return found


def _outlines_with_entrance(spaces: Spaces) -> set[int]:
    """Return which outlines have an entrance of their own (R1)."""
    doors = [shapely.Point(p.portal.centre) for p in spaces.passages if p.leads_outside]
    return {k for k, outline in enumerate(spaces.outlines) if any(outline.distance(door) < SHEET_M for door in doors)}


def building_id(level_id: str, number: int) -> str:
    """Return the id of a building of a level: ``house_L1`` becomes ``house_B2_L1``."""
    base, storey = re.fullmatch(r"(.*?)(_L\d+)?", level_id).groups()  # type: ignore[union-attr]
    return f"{base}_B{number}{storey or ''}"


def _lies_in(room: SourceRoom, part: Spaces) -> bool:
    shape = room.polygon if room.polygon is not None else shapely.box(*room.box) if room.box is not None else None
    return shape is not None and any(outline.intersects(shape.centroid) for outline in part.outlines)
