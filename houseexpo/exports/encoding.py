"""What the formats share: files as a mapping, and numbers, JSON and pictures as text or bytes."""

from __future__ import annotations

import io
import json
import re
from typing import TYPE_CHECKING, Any, TypeAlias

from houseexpo.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

Files: TypeAlias = dict[str, bytes]
"""The content of each file, by its name in the output folder."""


_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def plain(text: str) -> str:
    """Return a text without what no XML and no UTF-8 can hold: control characters and halves of surrogate pairs."""
    return _NO_XML.sub("\ufffd", text)


def number(value: float) -> str:
    """Return a number of metres as text to a tenth of a millimetre, without trailing zeros.

    Examples
    --------
    >>> number(2.50000001), number(-0.00001), number(3)
    ('2.5', '0', '3')
    """
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


def numbers(*values: float) -> str:
    """Return several numbers as text, separated by spaces."""
    return " ".join(map(number, values))


def pixels_per_metre(resolution: float) -> float:
    """Return the scale of a picture, given its metres per pixel; raise ConfigError unless they are more than 0."""
    if not resolution > 0:
        raise ConfigError(f"export: expected a resolution of more than 0 m a pixel, found {resolution!r}")
    return 1.0 / resolution


def compact_json(value: Any) -> bytes:
    """Return a value as JSON in UTF-8 on one line, with a final newline."""
    return (
        json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode("utf-8", "replace") + b"\n"
    )


def image(pixels: npt.NDArray[np.uint8], kind: str) -> bytes:
    """Return a picture (rows, cols) or (rows, cols, 3) as the bytes of an image file ("PNG", or "PPM" for pgm)."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind)
    return stream.getvalue()
