"""What the formats share: the files they make, and how a number is written."""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

Files: TypeAlias = dict[str, bytes]
"""Name inside the folder asked for -> content."""


def number(value: float) -> str:
    """Write metres to a tenth of a millimetre, without zeros at the end.

    Examples
    --------
    >>> number(2.50000001), number(-0.00001), number(3)
    ('2.5', '0', '3')
    """
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


def numbers(*values: float) -> str:
    """Write several, with blanks between."""
    return " ".join(map(number, values))


def as_json(value: Any) -> bytes:
    """Write JSON in UTF-8 with a line end."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def image(pixels: npt.NDArray[np.uint8], kind: str) -> bytes:
    """Write a picture (rows, cols) or (rows, cols, 3) as a file of that kind ("PNG", "PPM" for pgm)."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind)
    return stream.getvalue()
