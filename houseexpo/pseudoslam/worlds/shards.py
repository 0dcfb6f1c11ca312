"""Files of many records, each with the hash of its source as key; they are written once and then memory-mapped.

A file consists of a head, a table of (hash, offset, length, checksum) and the records. The head contains the file's
length and the checksum of the table, so that truncated files are detected. The checksum of a record is verified when it
is read.
"""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from houseexpo.files import write_whole

KEY_BYTES: Final = 20
"""Length of a hash (SHA-1), bytes."""

_MAGIC: Final = b"HXWORLDS"
_LAYOUT: Final = 1
_HEAD: Final = struct.Struct("<8sIIQI")
"""Magic number, layout, number of records, bytes of the file, checksum of the table."""
_ROW: Final = np.dtype([("key", f"V{KEY_BYTES}"), ("at", "<u8"), ("length", "<u4"), ("checksum", "<u4")])


class ShardError(Exception):
    """A file is not a shard, has another layout, or is incomplete."""


def write_shard(file: Path, records: Mapping[bytes, bytes]) -> None:
    """Write records by their hash atomically; raise OSError if the disk is full."""
    table = np.zeros(len(records), _ROW)
    at = _HEAD.size + table.nbytes
    for row, (key, data) in enumerate(records.items()):
        table[row] = np.void(key), at, len(data), zlib.crc32(data)
        at += len(data)
    rows = table.tobytes()
    head = _HEAD.pack(_MAGIC, _LAYOUT, len(records), at, zlib.crc32(rows))
    write_whole(file, b"".join([head, rows, *records.values()]))


class Shard:
    """A file of records; raises ShardError if it is incomplete."""

    def __init__(self, file: Path) -> None:
        try:
            with file.open("rb") as stream:
                self._data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:  # ValueError: it is empty
            raise ShardError(f"{file}: cannot be read ({error})") from None
        if len(self._data) < _HEAD.size:
            raise ShardError(f"{file}: expected a head of {_HEAD.size} bytes, found {len(self._data)}")
        magic, layout, number, size, checksum = _HEAD.unpack_from(self._data)
        end = _HEAD.size + number * _ROW.itemsize
        if (magic, layout) != (_MAGIC, _LAYOUT):
            raise ShardError(f"{file}: expected worlds in layout {_LAYOUT}, found {magic!r}, {layout}")
        if size != len(self._data) or end > size or zlib.crc32(self._data[_HEAD.size : end]) != checksum:
            raise ShardError(f"{file}: expected {size:,} whole bytes, found {len(self._data):,}, or others")
        table = np.frombuffer(self._data, _ROW, number, _HEAD.size)
        places = zip(table["at"].tolist(), table["length"].tolist(), table["checksum"].tolist(), strict=True)
        self._places = dict(zip(map(bytes, table["key"]), places, strict=True))

    def __len__(self) -> int:
        return len(self._places)

    def keys(self) -> list[bytes]:
        """Return the hashes of the records."""
        return list(self._places)

    def get(self, key: bytes) -> bytes | None:
        """Return a record, None if it is missing or damaged."""
        place = self._places.get(key)
        if place is None:
            return None
        at, length, checksum = place
        data = self._data[at : at + length]
        return data if zlib.crc32(data) == checksum else None
