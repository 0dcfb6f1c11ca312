"""What the JSON formats share: a document is decoded into typed values, and its lengths are checked."""

from __future__ import annotations

from typing import TypeVar

import msgspec
import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection

LARGEST_M = 1000.0
Document = TypeVar("Document")


def decoded(decoder: msgspec.json.Decoder[Document], data: bytes, name: str, advice: str) -> Document:
    """Decode a document; raises Rejection (EMPTY, UNREADABLE) that says which key is wrong."""
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", advice)
    try:
        return decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{name}: {error}", advice) from None


def check_lengths(numbers: npt.ArrayLike, what: str, advice: str) -> None:
    """Raise Rejection (NOT_FINITE, BAD_UNITS) where one of the lengths, metres, is none that a house can have."""
    values = np.abs(np.asarray(numbers, np.float64))
    if not np.isfinite(values).all():
        raise Rejection("source", Reason.NOT_FINITE, f"{what} has a number that is not finite", advice)
    largest = float(values.max(initial=0.0))
    if largest > LARGEST_M:
        detail = f"{what} has a length of {largest:.4g} m, expected {LARGEST_M:.0f} m at most"
        raise Rejection("source", Reason.BAD_UNITS, detail, "the format is in metres: correct it, or leave it out")
