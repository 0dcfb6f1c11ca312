"""Conversion of worlds to and from bytes: compressed bits of rasters, without moving obstacles."""

from __future__ import annotations

import struct
from functools import cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.worlds.world import MAX_CELLS, World

WORLDS: Final = 1
"""The version of worlds; change it when any raster of a house or this layout changes."""

_HEAD: Final = struct.Struct("<IIddQH")
"""Rows, columns, x and y of the grid's origin in metres, number of cells for coverage, bytes of the plan's id."""


class RecordError(Exception):
    """Bytes that are not a world of this version; the reader has to make the world again."""


def encode_world(world: World) -> bytes:
    """Return the bytes of a world: about 2 kB for a house of 120 m2 at 25 px/m, 1/30 of its bits."""
    rows, cols = world.occupied.shape
    name = world.plan_id.encode()
    head = _HEAD.pack(rows, cols, *world.frame.origin_m, world.observable_cells, len(name))
    rasters = (world.occupied, world.traversable, world.observable)
    bits = np.concatenate([np.packbits(raster) for raster in rasters])
    packed: bytes = _codec().compress(bits, asbytes=True)
    return head + name + packed


def decode_world(data: bytes | memoryview, pixels_per_metre: float) -> World:
    """Return an encoded world, with read-only rasters.

    Raise RecordError if the bytes are not a world of this version.
    """
    try:
        rows, cols, x, y, observable, length = _HEAD.unpack_from(data)
        cells = rows * cols
        if not 0 < cells <= MAX_CELLS:
            raise RecordError(f"a grid of {rows} x {cols} cells")
        begin = _HEAD.size + length
        name = bytes(data[_HEAD.size : begin]).decode()
        each = -(-cells // 8)
        bits = np.frombuffer(_codec().decompress(data[begin:], 3 * each), np.uint8)
        occupied, traversable, seen = (raster_of(packed, rows, cols) for packed in bits.reshape(3, each))
        frame = GridFrame((x, y), pixels_per_metre, (rows, cols), y_up=True)
        world = World(name, frame, occupied, traversable, seen)
    except (struct.error, UnicodeDecodeError, OSError, ValueError) as error:  # OSError: from the codec
        raise RecordError(str(error)) from None
    world.__dict__["observable_cells"] = observable  # known, so that it need not be counted
    return world


def raster_of(bits: npt.NDArray[np.uint8], rows: int, cols: int) -> npt.NDArray[np.uint8]:
    """Return a read-only raster from its bits, as made by ``np.packbits``."""
    raster = np.unpackbits(bits, count=rows * cols).reshape(rows, cols)
    raster.flags.writeable = False
    return raster


@cache
def _codec() -> Any:
    import pyarrow as pa

    return pa.Codec("zstd", compression_level=1)
