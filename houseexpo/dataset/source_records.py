"""Define what a person is shown of the source of a plan while they correct it: the record of an input.

``houseexpo build --show-source ID`` writes it (``pipeline.source_record``); the page Review reads it. Its coordinates
are those of the level frame, metres; ``LevelSource.frame`` maps them to the source.
"""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from houseexpo.plan import Frame

Points: TypeAlias = tuple[tuple[float, float], ...]
Rings: TypeAlias = tuple[Points, ...]
"""A polygon: its outer ring, and its holes."""


class Picture(msgspec.Struct, frozen=True):
    """A layer under the plan: a PNG that is clear where nothing is, and the area (x1, y1, x2, y2) that it covers."""

    name: str
    title: str
    bounds: tuple[float, float, float, float]
    png: bytes


class Place(msgspec.Struct, frozen=True):
    """A place that may close, whether the plan has a door there or not: what shows it, and its jambs."""

    kind: str
    ends: Points


class Stroke(msgspec.Struct, frozen=True):
    """A line of a drawing, whatever it was read as: what the file calls it (its layer), and its points."""

    kind: str
    points: Points


class PlanSource(msgspec.Struct, frozen=True):
    """A plan as it is without any correction of its storey.

    ``spaces`` are the spaces between walls, rooms or none; ``unreached`` are rooms into which nothing led;
    ``standing`` are the walls and what may close their gaps.
    ``is_founded``: the search finds no plan without the words of the storey, so this one has them in it.
    """

    id: str
    plan: msgspec.Raw
    spaces: tuple[Rings, ...] = ()
    unreached: tuple[Rings, ...] = ()
    standing: tuple[Rings, ...] = ()
    is_founded: bool = False


class LevelSource(msgspec.Struct, frozen=True):
    """What is known of a level; ``rejected`` says why it is no plan.

    ``edges`` are the walls, to which points snap. ``guesses`` names what the reader had to guess. ``extent`` is how far
    the walls reach along the source's axes, metres. ``strokes`` are the drawing's own lines.
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


class SourceRecord(msgspec.Struct, frozen=True):
    """An input, the file that it is read from, its levels, and the reason if none of it could be read.

    ``takes`` are the keys of ``overrides.toml`` that its reader takes. ``unit_m`` is the length of the file's own unit,
    metres, None if it is not known. ``names`` are what its parts are called.
    """

    id: str
    path: str = ""
    levels: tuple[LevelSource, ...] = ()
    rejected: str = ""
    takes: tuple[str, ...] = ()
    unit_m: float | None = None
    names: tuple[str, ...] = ()


def encode_source_record(record: SourceRecord) -> bytes:
    """Return the bytes of a record."""
    return msgspec.json.encode(record)


def decode_source_record(data: bytes) -> SourceRecord:
    """Return the record; raise ``msgspec.DecodeError`` or a ``ValidationError`` of it if the bytes are none."""
    return msgspec.json.decode(data, type=SourceRecord)
