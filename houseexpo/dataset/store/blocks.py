"""A block-compressed Arrow file of plans: to read a plan, only its block is decompressed."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Final

import pyarrow as pa

BLOCK: Final = 32
"""Plans per block: about 80 KB, which is decompressed in a tenth of a millisecond."""

_SCHEMA: Final = pa.schema([("plan", pa.large_binary())])


class BlockWriter:
    """A context manager that writes plans in order."""

    def __init__(self, path: Path) -> None:
        options = pa.ipc.IpcWriteOptions(compression=pa.Codec("zstd", compression_level=1))
        self._writer = pa.ipc.new_file(str(path), _SCHEMA, options=options)
        self._waiting: list[bytes] = []

    def __enter__(self) -> BlockWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._flush()
        self._writer.close()

    def add(self, data: bytes) -> None:
        """Add one plan."""
        self._waiting.append(data)
        if len(self._waiting) == BLOCK:
            self._flush()

    def _flush(self) -> None:
        if self._waiting:
            self._writer.write_batch(pa.record_batch([pa.array(self._waiting, pa.large_binary())], schema=_SCHEMA))
            self._waiting = []


class BlockReader:
    """A reader of plans by number. It keeps the last block, so that reading in order decompresses each block once."""

    def __init__(self, path: Path) -> None:
        options = pa.ipc.IpcReadOptions(use_threads=False)  # reading a block is faster than using a thread
        self._reader = pa.ipc.open_file(pa.memory_map(str(path)), options=options)
        self._last: tuple[int, Any] = (-1, None)

    def __len__(self) -> int:
        """Return the number of plans; all blocks but the last are full."""
        blocks = self._reader.num_record_batches
        return BLOCK * (blocks - 1) + int(self._reader.get_batch(blocks - 1).num_rows) if blocks else 0

    def __getitem__(self, number: int) -> bytes:
        block, place = divmod(number, BLOCK)
        at, batch = self._last
        if at != block:
            batch = self._reader.get_batch(block)
            self._last = block, batch  # one assignment: threads may share a reader
        data: bytes = batch.column(0)[place].as_py()
        return data
