"""Make the index of a data set, ``index.parquet``: one row per plan, for searching without opening the plans."""

from __future__ import annotations

import io
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from houseexpo.analysis.measures import MEASURES, Measure
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import RADII_M

_MEASURED = tuple(measure for measure in MEASURES if measure.column)
_OLD_COLUMNS = {"room_num": "source_rooms", "n_doors": "doors", "n_cuts": "cuts"}
"""The columns that version 0.2.0 named differently."""
_LATER = ("quality", "rooms", "copies")
"""Columns that a later version added to the index."""
_REACH = pa.struct([("components", pa.int32()), ("largest_share", pa.float64()), ("narrowest", pa.float64())])
SCHEMA = pa.schema(
    [
        ("id", pa.string()),
        ("rooms", pa.int32()),  # that the plan has
        ("source_rooms", pa.int32()),  # that its source counts
        ("area", pa.float64()),  # m2 of free space
        ("width", pa.float64()),  # m along x
        ("height", pa.float64()),  # m along y
        ("labels", pa.list_(pa.string())),  # without repetition, sorted
        ("doors", pa.int32()),
        ("cuts", pa.int32()),
        ("navigability", pa.struct([(f"{radius:.2f}", _REACH) for radius in RADII_M])),
        ("quality", pa.float64()),  # 0 to 1
        ("source", pa.string()),
        ("level", pa.int32()),
        ("split", pa.string()),
        ("copies", pa.list_(pa.string())),  # ids of the plans that a build left out as copies of this one, sorted
    ]
)


def with_current_columns(table: Any) -> Any:
    """Return the index of an earlier version with the columns of this one; values that it lacks are null.

    Raises
    ------
    pyarrow.ArrowException, KeyError
        It is not an index.
    """
    table = table.rename_columns([_OLD_COLUMNS.get(name, name) for name in table.column_names])
    for name in _LATER:
        if name not in table.column_names:
            table = table.append_column(name, pa.nulls(table.num_rows, SCHEMA.field(name).type))
    return table


def index_row(plan: FloorPlan, area: float | None = None) -> dict[str, Any]:
    """Return the row of a plan in the index.

    ``split`` is None until the data set is split, and so are columns that a published plan lacks. A build adds
    ``copies``. ``area`` is the area of the free space, m2, if it is already known.
    """
    return {
        "id": plan.id,
        **{m.column: _value(m.of(plan) if area is None or m.column != "area" else area, m) for m in _MEASURED},
        "labels": sorted(plan.room_category),
        "navigability": {
            radius: {"components": r.components, "largest_share": r.largest_share, "narrowest": r.narrowest}
            for radius, r in plan.navigability.items()
        }
        or None,
        "source": (plan.provenance or {}).get("source"),
        "level": None if plan.frame is None else plan.frame.level,
        "split": None,
    }


def _value(found: Any, measure: Measure) -> Any:
    """Return a number as the index has it: metres and square metres with two decimals."""
    return round(found, 2) if measure.unit else found


def index_table(rows: list[dict[str, Any]]) -> bytes:
    """Return the bytes of a Parquet file; equal rows give equal bytes."""
    stream = io.BytesIO()
    pq.write_table(pa.Table.from_pylist(rows, schema=SCHEMA), stream, compression="zstd")
    return stream.getvalue()
