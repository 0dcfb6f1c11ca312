"""Words in memory that many threads read and write, each time as a whole and in one order for all.

``words`` are whole numbers of 64 bits, a word is named by its place. What the functions say in Python holds for one
thread; numba compiles instructions in their place.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import extending, types

from houseexpo.pseudoslam.kernels.runtime.llvm import intrinsic, place
from houseexpo.pseudoslam.kernels.types import Counts


def get(words: Counts, word: int) -> int:
    """Return a word."""
    return int(words[word])


def put(words: Counts, word: int, value: int) -> None:
    """Set a word."""
    words[word] = value


def add(words: Counts, word: int, value: int) -> int:
    """Add to a word; return what it was before."""
    before = int(words[word])
    words[word] = before + value
    return before


def swap(words: Counts, word: int, old: int, new: int) -> bool:
    """Replace a word if it still is ``old``; return whether."""
    same = bool(words[word] == old)
    if same:
        words[word] = new
    return same


def pause() -> None:
    """Let what shares the core with this thread go first."""


@intrinsic
def _get(typing: Any, words: Any, word: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(place(context, builder, signature.args, arguments), "seq_cst", 8)

    return types.int64(words, types.intp), build


@intrinsic
def _put(typing: Any, words: Any, word: Any, value: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store_atomic(arguments[2], place(context, builder, signature.args, arguments), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(words, types.intp, types.int64), build


@intrinsic
def _add(typing: Any, words: Any, word: Any, value: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.atomic_rmw("add", place(context, builder, signature.args, arguments), arguments[2], "seq_cst")

    return types.int64(words, types.intp, types.int64), build


@intrinsic
def _swap(typing: Any, words: Any, word: Any, old: Any, new: Any) -> Any:  # noqa: ARG001
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word_at = place(context, builder, signature.args, arguments)
        return builder.extract_value(builder.cmpxchg(word_at, arguments[2], arguments[3], "seq_cst", "seq_cst"), 1)

    return types.boolean(words, types.intp, types.int64, types.int64), build


@intrinsic
def _pause(typing: Any) -> Any:  # noqa: ARG001
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


# ruff: noqa: ARG005, PLW0108  # numba compares the parameters of what it is given and of what that returns
extending.overload(get)(lambda words, word: lambda words, word: _get(words, word))
extending.overload(put)(lambda words, word, value: lambda words, word, value: _put(words, word, value))
extending.overload(add)(lambda words, word, value: lambda words, word, value: _add(words, word, value))
extending.overload(swap)(lambda words, word, old, new: lambda words, word, old, new: _swap(words, word, old, new))
extending.overload(pause)(lambda: lambda: _pause())
