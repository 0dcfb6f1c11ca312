"""What a PLY file's header announces, and whether the file can hold it."""

from __future__ import annotations

SIZES = {
    **dict.fromkeys((b"char", b"uchar", b"int8", b"uint8"), 1),
    **dict.fromkeys((b"short", b"ushort", b"int16", b"uint16"), 2),
    **dict.fromkeys((b"int", b"uint", b"int32", b"uint32", b"float", b"float32"), 4),
    **dict.fromkeys((b"double", b"float64"), 8),
}
ASCII_BYTES = 2  # a digit and what divides it from the next


def declared(head: bytes) -> tuple[int, int] | None:
    """Return (faces, bytes that all elements need at least) from the first bytes of a file; None without a header."""
    if not head.startswith(b"ply") or (end := head.find(b"end_header")) < 0:
        return None
    text, faces, needed, count = b"format ascii" in head[:end], 0, end, 0
    for line in head[:end].splitlines():
        words = line.split()
        if len(words) >= 3 and words[0] == b"element":
            count = int(words[2]) if words[2].isdigit() else 0
            faces += count if words[1] == b"face" else 0
        elif len(words) >= 3 and words[0] == b"property":
            kind = words[2] if words[1] == b"list" else words[1]
            needed += count * (ASCII_BYTES if text else SIZES.get(kind, 1))
    return faces, needed
