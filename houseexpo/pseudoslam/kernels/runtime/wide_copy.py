"""Many cells at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types

from houseexpo.pseudoslam.kernels.runtime.llvm import intrinsic, place
from houseexpo.pseudoslam.kernels.types import Grid

LINE = 32
"""Cells that ``copy_line`` copies, with one or two instructions each way."""


def load_eight(flat: Grid, first: int) -> int:
    """Return eight cells, side by side in a flat grid, as one whole number."""
    return int(flat[first : first + 8].view(np.uint64)[0])


@intrinsic
def _load_eight(typing: Any, flat: Any, first: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first_at = place(context, builder, signature.args, arguments)
        return builder.load(builder.bitcast(first_at, ir.IntType(64).as_pointer()), align=1)

    return types.uint64(flat, types.intp), build


def copy_line(to: Grid, at: int, flat: Grid, first: int) -> None:
    """Copy ``LINE`` cells, side by side in a flat grid, to a place in another."""
    to[at : at + LINE] = flat[first : first + LINE]


@intrinsic
def _copy_line(typing: Any, to: Any, at: Any, flat: Any, first: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        line = ir.VectorType(ir.IntType(8), LINE).as_pointer()
        kinds = signature.args
        places = (place(context, builder, kinds[k : k + 2], arguments[k : k + 2]) for k in (0, 2))
        to_at, from_at = (builder.bitcast(one, line) for one in places)
        builder.store(builder.load(from_at, align=1), to_at, align=1)
        return context.get_dummy_value()

    return types.void(to, types.intp, flat, types.intp), build


@extending.overload(load_eight)
def _compiled(flat, first):  # type: ignore[no-untyped-def]  # noqa: ARG001  # as numba compares them
    def build(flat, first):  # type: ignore[no-untyped-def]
        return _load_eight(flat, first)

    return build


@extending.overload(copy_line)
def _copied(to, at, flat, first):  # type: ignore[no-untyped-def]  # noqa: ARG001
    def build(to, at, flat, first):  # type: ignore[no-untyped-def]
        return _copy_line(to, at, flat, first)

    return build
