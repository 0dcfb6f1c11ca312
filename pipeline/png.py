"""A picture as the bytes of a PNG file."""

from __future__ import annotations

import io

import numpy as np
import numpy.typing as npt


def as_png(image: npt.NDArray[np.uint8]) -> bytes:
    """Return the file of a picture, (rows, cols) grey or (rows, cols, 3) RGB; equal pictures give equal bytes."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG", optimize=True)
    return stream.getvalue()
