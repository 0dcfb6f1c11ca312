"""LZF, with which PCD files are compressed: runs of literal bytes, and copies of what came before.

R1  A byte below 32 says how many literal bytes follow, less one.
R2  Any other says in its upper 3 bits how long a copy is, less two (7: a further byte adds to it), and in its lower 5
    bits, with the next byte, how far back it begins, less one.
"""

from __future__ import annotations


def unpacked(data: bytes, size: int) -> bytes:
    """Return the ``size`` bytes that were packed; raise ValueError if the data are not whole."""
    found = bytearray()
    at = 0
    try:
        while at < len(data):
            control = data[at]
            at += 1
            if control < 32:  # R1
                found += data[at : at + control + 1]
                at += control + 1
            else:  # R2
                length = control >> 5
                if length == 7:
                    length += data[at]
                    at += 1
                start = len(found) - ((control & 31) << 8) - data[at] - 1
                at += 1
                _copy(found, start, length + 2)
            if len(found) > size:
                break
    except IndexError:
        found.clear()
    if len(found) != size:
        raise ValueError(f"its compressed points are damaged: expected {size:,} bytes of them")
    return bytes(found)


def _copy(found: bytearray, start: int, length: int) -> None:
    """Append what stands at ``start``, again and again where that is shorter than ``length``."""
    if start < 0:
        raise IndexError
    piece = found[start : start + length]
    while len(piece) < length:
        piece += piece[: length - len(piece)]
    found += piece
