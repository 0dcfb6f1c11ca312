"""A world as bytes and back: rasters as bits, compressed. What moves is not in it."""

from __future__ import annotations

import struct
from functools import cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.worlds.world import MAX_CELLS, World

WORLDS: Final = 1
"""How worlds are made and written. Whatever changes a raster of any house, or the layout here, needs another number."""

_HEAD: Final = struct.Struct("<IIddQH")
"""Rows, columns, x and y of the grid's origin in metres, how many cells coverage counts, bytes of the plan's id."""


class RecordError(Exception):
    """Bytes are no world of this version; whoever reads them makes the world again."""


def encode_world(world: World) -> bytes:
    """Return the bytes of a world: some 2 kB for a house of 120 m2 at 25 px/m, 1/30 of the bits."""
    rows, cols = world.occupied.shape
    name = world.plan_id.encode()
    head = _HEAD.pack(rows, cols, *world.frame.origin_m, world.observable_cells, len(name))
    rasters = (world.occupied, world.traversable, world.observable)
    bits = np.concatenate([np.packbits(raster) for raster in rasters])
    packed: bytes = _codec().compress(bits, asbytes=True)
    return head + name + packed


def decode_world(data: bytes | memoryview, pixels_per_metre: float) -> World:
    """Return the world that was encoded; its rasters are not to be written to.

    RecordError where the bytes are none of a world.
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
    except (struct.error, UnicodeDecodeError, OSError, ValueError) as error:  # OSError: the codec's
        raise RecordError(str(error)) from None
    world.__dict__["observable_cells"] = observable  # it is known: nobody has to count
    return world


def raster_of(bits: npt.NDArray[np.uint8], rows: int, cols: int) -> npt.NDArray[np.uint8]:
    """Return a raster of its bits, as ``np.packbits`` makes them; it is not to be written to."""
    raster = np.unpackbits(bits, count=rows * cols).reshape(rows, cols)
    raster.flags.writeable = False
    return raster


@cache
def _codec() -> Any:
    import pyarrow as pa

    return pa.Codec("zstd", compression_level=1)
