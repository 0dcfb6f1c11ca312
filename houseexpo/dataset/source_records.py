"""Define the record of an input, from which the page Review shows the source of a plan that a person corrects.

``houseexpo build --show-source ID`` writes it (``pipeline.source_record``); the page Review reads it. Its coordinates
are in the level frame, metres; ``LevelSource.frame`` maps them to the source.
"""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from houseexpo.plan import Frame

Points: TypeAlias = tuple[tuple[float, float], ...]
Rings: TypeAlias = tuple[Points, ...]
"""A polygon: its outer ring, and its holes."""


class Picture(msgspec.Struct, frozen=True):
    """A layer under the plan: a PNG with a transparent background, and the area (x1, y1, x2, y2) that it covers."""

    name: str
    title: str
    bounds: tuple[float, float, float, float]
    png: bytes


class Place(msgspec.Struct, frozen=True):
    """A place where a door may be, with or without a door in the plan: the kind of evidence, and the two jambs."""

    kind: str
    ends: Points


class Stroke(msgspec.Struct, frozen=True):
    """A line of the drawing, whatever the reader made of it: its name in the file (its layer), and its points."""

    kind: str
    points: Points


class Solid(msgspec.Struct, frozen=True):
    """Triangles: corners (n, 3) as float32 in metres, z the height over the floor, and their indices (m, 3) as uint32.

    Both are little-endian.
    """

    corners: bytes
    faces: bytes


class PlanSource(msgspec.Struct, frozen=True):
    """A plan without the corrections of its storey.

    ``spaces`` are the spaces between walls, whether they are rooms or not. ``unreached`` are rooms that nothing led
    into. ``standing`` are the walls and whatever may close their gaps, ``walls`` the walls that the source shows.
    ``is_founded``: the search finds a plan only with the corrections of the storey, so this plan includes them.
    """

    id: str
    plan: msgspec.Raw
    spaces: tuple[Rings, ...] = ()
    unreached: tuple[Rings, ...] = ()
    standing: tuple[Rings, ...] = ()
    walls: tuple[Rings, ...] = ()
    is_founded: bool = False


class LevelSource(msgspec.Struct, frozen=True):
    """The source of a level; ``rejected`` is the reason if the level gave no plan.

    ``edges`` are the walls, to which points snap. ``guesses`` names the facts that the reader guessed. ``extent`` is
    the size of the walls' bounds along the source's two axes, metres. ``strokes`` are the drawing's own lines.
    ``solid`` is the level in three dimensions, or None if the source has no triangles. ``seen`` are straight lines of
    what stands higher than a person, ``seen_low`` those at the height of the lower section, where a mesh is cut.
    ``ceiling_m`` is the height of its rooms, metres, 0 if the source has none. ``parts`` are the names of parts of a
    mesh or an IFC file, with the bounds (x1, y1, x2, y2) of each in the level's frame, metres.
    ``layers`` are the names of the strokes of a level without a plan, the likeliest walls first.
    """

    id: str
    frame: Frame
    pictures: tuple[Picture, ...] = ()
    edges: tuple[Rings, ...] = ()
    places: tuple[Place, ...] = ()
    plans: tuple[PlanSource, ...] = ()
    rejected: str = ""
    guesses: tuple[str, ...] = ()
    extent: tuple[float, float] = (0.0, 0.0)
    strokes: tuple[Stroke, ...] = ()
    solid: Solid | None = None
    seen: tuple[Points, ...] = ()
    seen_low: tuple[Points, ...] = ()
    ceiling_m: float = 0.0
    parts: tuple[tuple[str, tuple[float, float, float, float]], ...] = ()
    layers: tuple[str, ...] = ()


class SourceRecord(msgspec.Struct, frozen=True):
    """An input, its file, its levels, and the reason if nothing could be read.

    ``reader``, ``key`` and ``options`` are how its file was read, with what is said of the file.

    ``takes`` are the keys of ``overrides.toml`` that its reader supports. ``unit_m`` is the length of the file's unit,
    metres, or None if it is unknown. ``other_units_m`` are other lengths of it, the likeliest first; ``is_odd``: one is
    clearly likelier by the sizes in the file. ``names`` are the names of its parts. ``other_floors`` are heights of
    level surfaces that were not taken for floors. ``side`` shows the file from the
    side, with the floors; the y of its bounds are heights.
    """

    id: str
    path: str = ""
    levels: tuple[LevelSource, ...] = ()
    rejected: str = ""
    takes: tuple[str, ...] = ()
    unit_m: float | None = None
    other_units_m: tuple[float, ...] = ()
    is_odd: bool = False
    names: tuple[str, ...] = ()
    other_floors: tuple[float, ...] = ()
    side: Picture | None = None
    reader: str = ""
    key: str = ""
    options: tuple[tuple[str, str], ...] = ()


def encode_source_record(record: SourceRecord) -> bytes:
    """Return a record as bytes for ``decode_source_record``."""
    return msgspec.json.encode(record)


def decode_source_record(data: bytes) -> SourceRecord:
    """Return the record in some bytes; raise ``msgspec.DecodeError`` (or its ``ValidationError``) if it is invalid."""
    return msgspec.json.decode(data, type=SourceRecord)
