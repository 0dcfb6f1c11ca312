"""Marks that people have put on the parts of plans: which spaces are rooms, which passages are ways.

Drawing the truth of a storey (``tests.corpus.truths``) takes long. To mark what a plan has of it takes a minute: a
person looks at the source, cut open and in sections, and says of each space whether it is a room of the house, and of
each passage whether one can walk through it. ``marks.jsonl`` holds a line for each storey of files that are not right::

    {"file": "NAME", "level": 0, "extent": [8.2, 6.1], "rooms": [[x, y, m2]], "unlike": [[x, y, m2]],
     "no_rooms": [[x, y, m2]], "ways": [[x, y]], "no_ways": [[x, y]]}

``houseexpo labels`` writes the same lines of reviewed houses, with the ``path`` of each file
(``houseexpo.service.review.labels``).

Lengths are metres in the source's plan axes. ``unlike`` are indoors, but not one room each: several rooms in one, or a
part of a room. ``no_rooms`` are terraces, courts, voids, the insides of walls, and what else was taken for rooms, or
might be. What a person could not tell is not in the file. What nobody has seen, because no plan had it, is not either.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

import msgspec

from pipeline.fitting.labels import Marked

MARKS: Final = Path(__file__).with_name("marks.jsonl")


@cache
def load(path: Path = MARKS) -> dict[str, list[Marked]]:
    """Return the marked storeys by the names of their files."""
    found: dict[str, list[Marked]] = {}
    for line in path.read_bytes().splitlines():
        marked = msgspec.json.decode(line, type=Marked)
        found.setdefault(marked.file, []).append(marked)
    return found
