"""Eight cells at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types

from houseexpo.pseudoslam.kernels.instructions import intrinsic, place
from houseexpo.pseudoslam.kernels.types import Grid


def eight(flat: Grid, first: int) -> int:
    """Return eight cells, side by side in a flat grid, as one whole number."""
    return int(flat[first : first + 8].view(np.uint64)[0])


@intrinsic
def _eight(typing: Any, flat: Any, first: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first_at = place(context, builder, signature, arguments)
        return builder.load(builder.bitcast(first_at, ir.IntType(64).as_pointer()), align=1)

    return types.uint64(flat, types.intp), build


@extending.overload(eight)
def _compiled(flat, first):  # type: ignore[no-untyped-def]  # noqa: ARG001  # as numba compares them
    def build(flat, first):  # type: ignore[no-untyped-def]
        return _eight(flat, first)

    return build
