"""Decode buffer views that meshoptimizer compressed (glTF extension EXT_meshopt_compression).

The streams are those of the extension's specification, "Appendix A: Bitstream": mode ATTRIBUTES, version 0; mode
TRIANGLES, versions 0 and 1; mode INDICES, version 1. Of the filters only EXPONENTIAL is undone: the others hold
normals, tangents and rotations, which are not read here.

A1  Attributes come in blocks of elements. In a block, each byte of the elements is a row of differences to the element
    before, in groups of 16. A group has 0, 2, 4 or 8 bits for a difference; one that does not fit follows as a byte.
A2  The element before the first one stands at the end of the stream.
T1  Triangles share edges and vertices with those before. Two queues of 16 places hold the latest edges and vertices;
    one byte a triangle says which of them it takes, and which vertices are the next new ones.
T2  An index that no queue has follows as a difference to the last such index, in steps of 7 bits.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]

GROUP_SIZE: Final = 16
BLOCK_BYTES: Final = 8192
MOST_IN_BLOCK: Final = 256
SHORTEST_TAIL: Final = 32
QUEUE: Final = 15
"""Places in a queue, less one: a mask for places in it."""

ATTRIBUTES, TRIANGLES, INDICES = 0xA0, (0xE0, 0xE1), 0xD1
AUXILIARY: Final = 16


def decode_view(data: bytes, extension: dict[str, Any]) -> bytes:
    """Return the bytes that a compressed buffer view holds; ``extension`` is its entry of the extension.

    Raises
    ------
    ValueError
        Where the stream is broken, or of a version or mode that is not known.
    """
    count, stride = int(extension["count"]), int(extension["byteStride"])
    if count < 0 or not 0 < stride <= MOST_IN_BLOCK:
        raise ValueError(f"a compressed view has {count:,} elements of {stride} bytes")
    mode = extension["mode"]
    if mode == "ATTRIBUTES":
        found = decode_attributes(data, count, stride)
        return (_undo_exponential(found) if extension.get("filter") == "EXPONENTIAL" else found).tobytes()
    if mode not in {"TRIANGLES", "INDICES"} or stride not in {2, 4}:
        raise ValueError(f"a compressed view has mode {mode!r} and {stride} bytes an index")
    indices = decode_triangles(data, count) if mode == "TRIANGLES" else decode_indices(data, count)
    return indices.astype(f"<u{stride}").tobytes()


def decode_attributes(data: bytes, count: int, stride: int) -> Bytes:
    """Return elements (count, stride) of a stream of mode ATTRIBUTES (A1, A2)."""
    if not data or data[0] != ATTRIBUTES:
        raise ValueError(f"expected attributes of version 0, found {data[:1].hex() or 'nothing'}")
    stream = np.frombuffer(data, np.uint8)
    if len(stream) <= max(stride, SHORTEST_TAIL):
        raise ValueError("compressed attributes end early")
    last = stream[len(stream) - stride :]
    end, at = len(stream) - max(stride, SHORTEST_TAIL), 1
    in_block = min(BLOCK_BYTES // stride // GROUP_SIZE * GROUP_SIZE, MOST_IN_BLOCK)
    elements = np.empty((count, stride), np.uint8)
    for start in range(0, count, in_block):
        size = min(in_block, count - start)
        rows = np.empty((stride, -(-size // GROUP_SIZE) * GROUP_SIZE), np.uint8)
        for row in rows:
            at = _decode_row(stream, at, end, row)
        changes = (rows >> 1) ^ (0 - (rows & 1))  # zigzag: 0, -1, 1, -2, ...
        block = np.cumsum(changes[:, :size], axis=1, dtype=np.uint8).T + last
        elements[start : start + size] = block
        last = block[-1]
    return elements


def _decode_row(stream: Bytes, at: int, end: int, row: Bytes) -> int:
    """Fill a row of differences (A1) from place ``at`` on; return the place behind it."""
    groups = len(row) // GROUP_SIZE
    modes = stream[at : at + -(-groups // 4)]
    at += len(modes)
    for k in range(groups):
        values = row[k * GROUP_SIZE : (k + 1) * GROUP_SIZE]
        bits = (0, 2, 4, 8)[(int(modes[k // 4]) >> k % 4 * 2) & 3]
        packed = stream[at : at + 2 * bits]
        at += 2 * bits
        if at > end:
            raise ValueError("compressed attributes end early")
        if bits == 8:
            values[:] = packed
        elif bits == 0:
            values[:] = 0
        else:
            shifts = np.arange(8 - bits, -1, -bits, dtype=np.uint8)
            values[:] = ((packed[:, None] >> shifts) & ((1 << bits) - 1)).ravel()
            wide = np.flatnonzero(values == (1 << bits) - 1)
            if at + len(wide) > end:
                raise ValueError("compressed attributes end early")
            values[wide] = stream[at : at + len(wide)]
            at += len(wide)
    return at


def _undo_exponential(elements: Bytes) -> Bytes:
    """Return numbers of an exponent (8 bits) and a mantissa (24 bits, signed) as floats of 4 bytes."""
    words = np.ascontiguousarray(elements).view("<i4")
    mantissa = (words << 8) >> 8
    floats: npt.NDArray[np.float32] = np.ldexp(mantissa.astype(np.float32), words >> 24).astype("<f4")
    return floats.view(np.uint8)


class _IndexStream:
    """Reads bytes, and indices that are differences to the last one (T2)."""

    def __init__(self, data: bytes, at: int, end: int) -> None:
        self._data, self._at, self._end = data, at, end

    def byte(self) -> int:
        if self._at >= self._end:
            raise ValueError("compressed indices end early")
        self._at += 1
        return self._data[self._at - 1]

    def number(self) -> int:
        value = shift = 0
        while shift < 35:
            part = self.byte()
            value |= (part & 127) << shift
            if part < 128:
                break
            shift += 7
        return value


def _to_signed(value: int) -> int:
    return (value >> 1) ^ -(value & 1)


def decode_indices(data: bytes, count: int) -> npt.NDArray[np.uint32]:
    """Return indices (count,) of a stream of mode INDICES: each is a difference to one of two bases."""
    if not data or data[0] != INDICES:
        raise ValueError(f"expected indices of version 1, found {data[:1].hex() or 'nothing'}")
    stream, last = _IndexStream(data, 1, len(data) - 4), [0, 0]
    found = np.empty(count, np.uint32)
    for k in range(count):
        value = stream.number()
        base = value & 1
        last[base] = (last[base] + _to_signed(value >> 1)) & 0xFFFFFFFF
        found[k] = last[base]
    return found


def decode_triangles(data: bytes, count: int) -> npt.NDArray[np.uint32]:
    """Return the corners (count,) of a stream of mode TRIANGLES (T1, T2)."""
    if count % 3 or not data or data[0] not in TRIANGLES:
        raise ValueError(f"expected triangles of version 0 or 1, found {data[:1].hex() or 'nothing'}, {count} corners")
    if len(data) < 1 + count // 3 + AUXILIARY:
        raise ValueError("compressed triangles end early")
    decoder = _TriangleDecoder(data, count)
    found = np.empty((count // 3, 3), np.uint32)
    for k, code in enumerate(data[1 : 1 + count // 3]):
        found[k] = decoder.at_edge(code >> 4, code & 15) if code < 0xF0 else decoder.apart(code)
    return found.ravel()


class _TriangleDecoder:
    """The queues of edges and vertices (T1), the next new vertex, and the last index that was written out (T2)."""

    def __init__(self, data: bytes, count: int) -> None:
        self._auxiliary = data[len(data) - AUXILIARY :]
        self._stream = _IndexStream(data, 1 + count // 3, len(data) - AUXILIARY)
        self._written = 15 if data[0] == TRIANGLES[0] else 13
        self._edges, self._vertices = [(0, 0)] * (QUEUE + 1), [0] * (QUEUE + 1)
        self._edge_at = self._vertex_at = self._next = self._last = 0

    def at_edge(self, edge: int, code: int) -> tuple[int, int, int]:
        """Return a triangle at an edge of the queue; ``code`` says which is its third corner."""
        a, b = self._edges[(self._edge_at - 1 - edge) & QUEUE]
        if 0 < code < self._written:
            c = self._vertices[(self._vertex_at - 1 - code) & QUEUE]
        else:
            if code == 0:
                c = self._new()
            elif code == 15:
                c = self._read()
            else:  # one before or behind the last that was written out
                c = self._last = (self._last + (-1 if code == 13 else 1)) & 0xFFFFFFFF
            self._push(c)
        self._push_edges((c, b), (a, c))
        return a, b, c

    def apart(self, code: int) -> tuple[int, int, int]:
        """Return a triangle that shares no edge of the queue."""
        pair = self._auxiliary[code & 15] if code < 0xFE else self._stream.byte()
        codes = (15 if code == 0xFF else 0, pair >> 4, pair & 15)
        if code >= 0xFE and pair == 0:
            self._next = 0
        corners = []
        for of_corner in codes:  # new vertices are counted before what is written out is read
            if of_corner == 0:
                corners.append(self._new())
            else:
                corners.append(self._vertices[(self._vertex_at - of_corner) & QUEUE])
        for k, of_corner in enumerate(codes):
            if of_corner == 15 and code >= 0xFE:
                corners[k] = self._read()
        a, b, c = corners
        for corner, of_corner in zip(corners, codes, strict=True):
            if of_corner == 0 or (of_corner == 15 and code >= 0xFE):
                self._push(corner)
        self._push_edges((b, a), (c, b), (a, c))
        return a, b, c

    def _new(self) -> int:
        self._next += 1
        return self._next - 1

    def _read(self) -> int:
        self._last = (self._last + _to_signed(self._stream.number())) & 0xFFFFFFFF
        return self._last

    def _push(self, vertex: int) -> None:
        self._vertices[self._vertex_at & QUEUE] = vertex
        self._vertex_at += 1

    def _push_edges(self, *edges: tuple[int, int]) -> None:
        for edge in edges:
            self._edges[self._edge_at & QUEUE] = edge
            self._edge_at += 1
