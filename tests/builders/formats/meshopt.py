"""Writes buffer views as meshoptimizer compresses them, as the specification of EXT_meshopt_compression has it."""

from __future__ import annotations

import numpy as np


def encode_attributes(elements):
    """Write elements (n, stride) of bytes; each group takes the fewest bits that the specification has."""
    count, stride = elements.shape
    stream, before = bytearray([0xA0]), elements[0]
    in_block = min(8192 // stride // 16 * 16, 256)
    for start in range(0, count, in_block):
        block = elements[start : start + in_block]
        change = np.diff(np.vstack([before, block]).astype(np.int64), axis=0).astype(np.uint8).view(np.int8)
        zigzag = ((change.astype(np.int64) << 1) ^ (change.astype(np.int64) >> 7)) & 255
        before = block[-1]
        groups = -(-len(block) // 16)
        padded = np.zeros((groups * 16, stride), np.int64)
        padded[: len(block)] = zigzag
        for row in padded.T.reshape(stride, groups, 16):
            written = [min((_pack(group, bits) for bits in (0, 2, 4, 8)), key=len) for group in row]
            modes = [part[0] for part in written] + [0] * (-groups % 4)
            stream += bytes(sum(modes[k + i] << 2 * i for i in range(4)) for k in range(0, len(modes), 4))
            for part in written:
                stream += part[1:]
    return bytes(stream + bytes(max(32 - stride, 0)) + elements[0].tobytes())


def _pack(group, bits):
    """Return the mode of a group, then its differences; too many bytes where they do not fit."""
    mode = (0, 2, 4, 8).index(bits)
    if bits == 0:
        return bytes([mode]) if not group.any() else bytes(99)
    if bits == 8:
        return bytes([mode, *group])
    top = (1 << bits) - 1
    small = np.minimum(group, top).reshape(-1, 8 // bits)
    packed = (small << np.arange(8 - bits, -1, -bits)).sum(axis=1)
    return bytes([mode, *packed, *group[group >= top]])


class TriangleEncoder:
    """Writes triangles with every code that fits: edges and vertices of the queues, new ones, neighbours, numbers."""

    def __init__(self, version):
        self.version, self.most = version, 13 if version else 15
        self.edges, self.vertices, self.next, self.last = [], [], 0, 0
        self.codes, self.data = bytearray(), bytearray()
        self.auxiliary = bytes(
            [0x00, 0x01, 0x10, 0x12, 0x21, 0x23, 0x32, 0x34, 0x43, 0x02, 0x20, 0x13, 0x31, 0x24, 0, 0]
        )

    def write(self, triangles):
        for triangle in triangles:
            self.add([int(corner) for corner in triangle])
        return bytes([0xE0 + self.version]) + bytes(self.codes + self.data) + self.auxiliary

    def add(self, triangle):
        for turn in range(3):
            a, b, c = triangle[turn:] + triangle[:turn]
            place = next((k for k, edge in enumerate(self.edges[:-17:-1]) if edge == (a, b)), 15)
            if place < 15:
                return self.at_edge(place, a, b, c)
        return self.apart(*triangle)

    def at_edge(self, place, a, b, c):
        recent = self.vertices[:-17:-1]
        if c == self.next:
            code, self.next = 0, self.next + 1
        elif c in recent[1 : self.most]:
            self.codes.append(place << 4 | recent.index(c, 1))
            self.edges += [(c, b), (a, c)]
            return
        elif self.version and abs(c - self.last) == 1:
            code = 13 if c < self.last else 14
            self.last = c
        else:
            code = 15
            self.number(c)
        self.codes.append(place << 4 | code)
        self.vertices.append(c)
        self.edges += [(c, b), (a, c)]

    def apart(self, a, b, c):
        recent = self.vertices[:-17:-1]
        of_a, self.next = (0, self.next + 1) if a == self.next else (15, self.next)
        pair = []
        for corner in (b, c):
            if corner == self.next:
                pair.append(0)
                self.next += 1
            else:
                pair.append(recent.index(corner) + 1 if corner in recent[:14] else 15)
        if of_a and not any(pair):  # that would stand for a new start
            self.next, pair = self.next - 2, [15, 15]
        packed = pair[0] << 4 | pair[1]
        if of_a == 0 and packed in self.auxiliary[:14] and 15 not in pair:
            self.codes.append(0xF0 | self.auxiliary.index(packed))
        else:
            self.codes.append(0xFE if of_a == 0 else 0xFF)
            self.data.append(packed)
        for corner, code in zip((a, b, c), (of_a, *pair), strict=True):
            if code == 15:
                self.number(corner)
        self.vertices += [corner for corner, code in zip((a, b, c), (of_a, *pair), strict=True) if code in {0, 15}]
        self.edges += [(b, a), (c, b), (a, c)]

    def number(self, index):
        self.data += variable(zigzag(index - self.last))
        self.last = index


def zigzag(value):
    return value << 1 if value >= 0 else (-value << 1) - 1


def variable(value):
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return found + bytes([value])
