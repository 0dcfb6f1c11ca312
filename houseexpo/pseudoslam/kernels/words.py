"""Eight cells at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

from houseexpo.pseudoslam.kernels.types import Grid

intrinsic: Any = extending.intrinsic  # an instruction that numba has no name for
pointer_to: Any = cgutils.get_item_pointer


def eight(flat: Grid, first: int) -> int:
    """Return eight cells, side by side in a flat grid, as one whole number."""
    return int(flat[first : first + 8].view(np.uint64)[0])


@intrinsic
def _eight(typing: Any, flat: Any, first: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        place = pointer_to(context, builder, signature.args[0], array, [arguments[1]])
        return builder.load(builder.bitcast(place, ir.IntType(64).as_pointer()), align=1)

    return types.uint64(flat, types.intp), build


@extending.overload(eight)
def _compiled(flat, first):  # type: ignore[no-untyped-def]  # noqa: ARG001  # as numba compares them
    def build(flat, first):  # type: ignore[no-untyped-def]
        return _eight(flat, first)

    return build
