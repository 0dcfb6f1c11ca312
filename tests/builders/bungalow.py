"""The house of the guide's corrections: its bedroom door is modelled shut, as part of the wall, and its patio is open.

::

    y 6.2 +--------------------+----------+
          |                    |  patio   |
          |   living room      D          |
    3.2   |                    +----------+
          |                    x  bedroom |     D doors under lintels, x the door that is modelled shut
    0.0   +--------D-----------+----------+
          x 0                  5        9.2
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import trimesh

FILE: Final = Path(__file__).resolve().parents[2] / "pipeline" / "examples" / "houses" / "bungalow.obj"
HEIGHT_M: Final = 2.6
HEAD_M: Final = 2.0

BEDROOM_DOOR: Final = ((5.1, 1.0), (5.1, 1.9))
"""From jamb to jamb, on the wall's centre line."""

PATIO: Final = (7.1, 4.7)
ROOMS_M2: Final = (4.8 * 5.8, 3.8 * 2.9)
"""The living room and the bedroom."""

_WALLS: Final = (
    (0.0, 0.0, 2.0, 0.2), (2.9, 0.0, 9.2, 0.2),  # the front, with the front door
    (0.0, 6.0, 9.2, 6.2), (0.0, 0.2, 0.2, 6.0), (9.0, 0.2, 9.2, 6.0),
    (5.0, 0.2, 5.2, 4.0), (5.0, 4.9, 5.2, 6.0),  # the bedroom door is part of the first
    (5.2, 3.1, 9.0, 3.3),
)  # fmt: skip
_LINTELS: Final = ((2.0, 0.0, 2.9, 0.2), (5.0, 4.0, 5.2, 4.9))


def write_bungalow(path: Path = FILE) -> Path:
    """Write the house as OBJ: z up, metres, a group for each part."""
    lines = ["# made by tests/builders/bungalow.py; metres, z up"]
    base = 1
    for name, (x1, y1, x2, y2), low, high in _parts():
        box = trimesh.creation.box(bounds=[[x1, y1, low], [x2, y2, high]])
        lines.append(f"g {name}")
        lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in np.round(box.vertices, 3).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (box.faces + base).tolist()]
        base += len(box.vertices)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    return path


def _parts() -> Iterator[tuple[str, tuple[float, float, float, float], float, float]]:
    for number, box in enumerate(_WALLS):
        yield f"Part_{number}", box, 0.0, HEIGHT_M
    for number, box in enumerate(_LINTELS, start=len(_WALLS)):
        yield f"Part_{number}", box, HEAD_M, HEIGHT_M
    yield "Slab", (0.0, 0.0, 9.2, 6.2), -0.2, 0.0
