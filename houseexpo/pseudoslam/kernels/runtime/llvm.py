"""Writing down instructions that numba has no name for."""

from __future__ import annotations

from typing import Any

from numba import extending
from numba.core import cgutils

intrinsic: Any = extending.intrinsic


def place(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
    """Return a pointer to the element of a flat array that an intrinsic's first two arguments, of these kinds, name."""
    kind = kinds[0]
    array = context.make_array(kind)(context, builder, arguments[0])
    return cgutils.get_item_pointer(context, builder, kind, array, [arguments[1]])  # type: ignore[no-untyped-call]
