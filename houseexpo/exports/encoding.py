"""Write numbers, JSON and pictures as text or bytes for exports, and replace characters that XML cannot hold.

``Files`` is the result of a format's function: the content of each file, by its name.
"""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

from houseexpo.errors import ConfigError, PlanError
from houseexpo.grids.frame import FEWEST_CELLS, is_too_coarse

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from houseexpo.floorplan import FloorPlan

Files: TypeAlias = dict[str, bytes]
"""The content of each file, by its name in the output folder."""


_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def valid_xml_text(text: str) -> str:
    """Return a text without characters that XML or UTF-8 cannot hold: controls and halves of surrogate pairs."""
    return _NO_XML.sub("\ufffd", text)


def format_number(value: float) -> str:
    """Return a number of metres as text to a tenth of a millimetre, without trailing zeros.

    Examples
    --------
    >>> format_number(2.50000001), format_number(-0.00001), format_number(3)
    ('2.5', '0', '3')
    """
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


def format_numbers(*values: float) -> str:
    """Return several numbers as text, separated by spaces."""
    return " ".join(map(format_number, values))


def picture_scale(plan: FloorPlan, resolution: float) -> float:
    """Return the scale of a plan's picture, given its metres per pixel.

    Raises
    ------
    ConfigError
        The resolution is not more than 0 m.
    PlanError
        The plan would be smaller than a few pixels.
    """
    if not (0 < resolution < math.inf and 1.0 / resolution < math.inf):
        raise ConfigError(f"export: expected a resolution of more than 0 m a pixel, found {resolution!r}")
    if is_too_coarse(plan.bbox, 1.0 / resolution):
        x1, y1, x2, y2 = plan.bbox
        raise PlanError(
            f"expected a resolution of at most {max(x2 - x1, y2 - y1) / FEWEST_CELLS:.3g} m a pixel for "
            f"{x2 - x1:.2f} x {y2 - y1:.2f} m, found {resolution:g}, which shows nothing of it; choose a finer one",
            plan=plan.id,
        )
    return 1.0 / resolution


def compact_json(value: Any) -> bytes:
    """Return a value as JSON in UTF-8 on one line, with a final newline."""
    return (
        json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode("utf-8", "replace") + b"\n"
    )


def encode_image(pixels: npt.NDArray[np.uint8], kind: str, text: Mapping[str, str] | None = None) -> bytes:
    """Return a picture (rows, cols) or (rows, cols, 3) as the bytes of an image file ("PNG", or "PPM" for pgm).

    ``text`` is written into a PNG, by keyword.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    stream, chunks = io.BytesIO(), PngInfo()
    for keyword, said in (text or {}).items():
        chunks.add_text(keyword, said)
    Image.fromarray(pixels).save(stream, kind, **({"pnginfo": chunks} if text else {}))
    return stream.getvalue()
