"""Words in memory that many threads read and write, each time as a whole and in one order for all.

``words`` are whole numbers of 64 bits, a word is named by its place.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

intrinsic: Any = extending.intrinsic  # instructions that numba has no name for
pointer_to: Any = cgutils.get_item_pointer


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Return a pointer to the word that an intrinsic's first two arguments name."""
    kind = signature.args[0]
    array = context.make_array(kind)(context, builder, arguments[0])
    return pointer_to(context, builder, kind, array, [arguments[1]])


@intrinsic
def get(typing: Any, words: Any, word: Any) -> Any:  # noqa: ARG001
    """Return a word."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_place(context, builder, signature, arguments), "seq_cst", 8)

    return types.int64(words, types.intp), build


@intrinsic
def put(typing: Any, words: Any, word: Any, value: Any) -> Any:  # noqa: ARG001
    """Set a word."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store_atomic(arguments[2], _place(context, builder, signature, arguments), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(words, types.intp, types.int64), build


@intrinsic
def add(typing: Any, words: Any, word: Any, value: Any) -> Any:  # noqa: ARG001
    """Add to a word."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.atomic_rmw("add", _place(context, builder, signature, arguments), arguments[2], "seq_cst")
        return context.get_dummy_value()

    return types.void(words, types.intp, types.int64), build


@intrinsic
def swap(typing: Any, words: Any, word: Any, old: Any, new: Any) -> Any:  # noqa: ARG001
    """Replace a word if it still is ``old``; return whether."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, signature, arguments)
        return builder.extract_value(builder.cmpxchg(place, arguments[2], arguments[3], "seq_cst", "seq_cst"), 1)

    return types.boolean(words, types.intp, types.int64, types.int64), build


@intrinsic
def pause(typing: Any) -> Any:  # noqa: ARG001
    """Let what shares the core with this thread go first."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        machine = llvmlite.binding.get_process_triple().partition("-")[0]
        nothing, hint = ir.VoidType(), ir.IntType(32)
        if machine == "x86_64":
            pause = ir.FunctionType(nothing, [])
            builder.call(builder.module.declare_intrinsic("llvm.x86.sse2.pause", (), pause), [])
        elif machine in {"aarch64", "arm64"}:
            yields = ir.FunctionType(nothing, [hint])
            builder.call(builder.module.declare_intrinsic("llvm.aarch64.hint", (), yields), [hint(1)])
        return context.get_dummy_value()

    return types.void(), build
