"""Write tables as Parquet files, in small row groups and with settings that give reproducible bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from houseexpo.release.tables import Row, Table, schema_of

GROUP_BYTES: Final = 32 * 2**20
"""A row group is closed at this size; the last rows that are added may exceed it a little."""

GROUP_ROWS: Final = 10_000


class TableWriter:
    """A context manager that writes one file of a table, one row group at a time."""

    def __init__(self, file: Path, table: Table) -> None:
        self._schema = schema_of(table)
        words = [column.name for column in table.columns if column.type == pa.string()]
        self._writer: Any = pq.ParquetWriter(
            file,
            self._schema,
            version="2.6",
            data_page_version="1.0",
            compression="zstd",
            compression_level=3,
            use_dictionary=words,
            write_page_index=True,
        )
        self._waiting: list[Any] = []
        self._bytes = 0
        self.rows = 0

    def __enter__(self) -> TableWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._flush()
        self._writer.close()

    def add(self, rows: Sequence[Row]) -> None:
        """Add rows, in order."""
        batch = pa.RecordBatch.from_pylist(list(rows), schema=self._schema)
        self._waiting.append(batch)
        self._bytes += batch.nbytes
        self.rows += batch.num_rows
        if self._bytes >= GROUP_BYTES or sum(waiting.num_rows for waiting in self._waiting) >= GROUP_ROWS:
            self._flush()

    def _flush(self) -> None:
        table = pa.Table.from_batches(self._waiting, schema=self._schema)
        if table.num_rows:
            self._writer.write_table(table, row_group_size=table.num_rows)
        self._waiting, self._bytes = [], 0
