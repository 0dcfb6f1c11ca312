"""Parse and build messages of DDSI-RTPS 2.5 as values, as far as the servers of services need them; no sockets.

A message is a header and submessages (9.4). Identifiers are bytes: a prefix names a participant (12), an entity is one
of its readers and writers (4), both together are a guid (16). Sequence numbers start at 1.
"""

from __future__ import annotations

import ipaddress
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

Address: TypeAlias = tuple[str, int]

NOBODY: Final = bytes(12)
"""The prefix that means any participant."""
PARTICIPANT: Final = bytes.fromhex("000001c1")
SPDP_WRITER, SPDP_READER = bytes.fromhex("000100c2"), bytes.fromhex("000100c7")
WRITERS_WRITER, WRITERS_READER = bytes.fromhex("000003c2"), bytes.fromhex("000003c7")
"""The endpoints by which participants tell each other of their writers (8.5.4)."""
READERS_WRITER, READERS_READER = bytes.fromhex("000004c2"), bytes.fromhex("000004c7")
"""The same of their readers."""
BUILTIN: Final = 0x3F
"""A participant that has all of these endpoints (9.3.2.12)."""

LEASE, TOPIC, TYPE, VERSION, VENDOR = 0x0002, 0x0005, 0x0007, 0x0015, 0x0016
RELIABILITY, DURABILITY = 0x001A, 0x001D
LOCATOR, DEFAULT_LOCATOR, META_LOCATOR = 0x002F, 0x0031, 0x0032
PARTICIPANT_GUID, BUILTIN_SET, ENDPOINT_GUID, KEY_HASH, STATUS = 0x0050, 0x0058, 0x005A, 0x0070, 0x0071
RELATED, RELATED_OF_FAST_DDS = 0x0083, 0x800F
"""The identity of the sample that a sample answers: of DDS-RPC 1.0 (7.8.2), and the number that Fast DDS also uses."""
_SENTINEL: Final = 0x0001

_MAGIC: Final = b"RTPS"
_VERSION: Final = b"\x02\x03"
_UDP_V4: Final = 1
_ACKNACK, _HEARTBEAT, _GAP, _INFO_SOURCE, _INFO_TARGET = 0x06, 0x07, 0x08, 0x0C, 0x0E
_NACK_FRAGMENT, _DATA, _FRAGMENT = 0x12, 0x15, 0x16
_LITTLE, _FINAL, _INLINE, _PAYLOAD, _KEY = 0x01, 0x02, 0x02, 0x04, 0x08
_BITS_MOST: Final = 256
_HIGH_MOST: Final = 2**30  # of a sequence number's upper 32 bits: what is added to such a number still fits


@dataclass(frozen=True)
class Data:
    """A sample; ``parameters`` are its inline QoS, ``payload`` is None if it has none or is a fragment."""

    reader: bytes
    writer: bytes
    number: int
    parameters: Mapping[int, bytes]
    payload: bytes | None
    is_fragment: bool = False


@dataclass(frozen=True)
class Heartbeat:
    """A writer has the samples from ``first`` to ``last``; unless it is final, it wants an answer."""

    reader: bytes
    writer: bytes
    first: int
    last: int
    is_final: bool


@dataclass(frozen=True)
class AckNack:
    """A reader has all samples before ``base`` (0: it does not say), and asks for the ``missing`` ones."""

    reader: bytes
    writer: bytes
    base: int
    missing: Sequence[int]
    is_final: bool


@dataclass(frozen=True)
class Gap:
    """Samples from ``start`` until before ``base``, and the ``others``, are of no concern to the reader."""

    reader: bytes
    writer: bytes
    start: int
    base: int
    others: Sequence[int]


Submessage: TypeAlias = Data | Heartbeat | AckNack | Gap


@dataclass(frozen=True)
class ReceivedSubmessage:
    """A submessage with the participant that sent it and its vendor (2 bytes)."""

    prefix: bytes
    vendor: bytes
    part: Submessage


def parse_submessages(message: bytes, own: bytes) -> Iterator[ReceivedSubmessage]:
    """Yield the submessages of a message that are meant for the participant ``own``; others' are left out.

    Raises
    ------
    ValueError
        The message is no message of RTPS 2, or ends too early.
    """
    if len(message) < 20 or message[:4] != _MAGIC or message[4] != _VERSION[0]:
        raise ValueError("no message of RTPS 2")
    vendor, prefix, target, at = message[6:8], message[8:20], own, 20
    try:
        while at + 4 <= len(message):
            kind, flags = message[at], message[at + 1]
            order = "<" if flags & _LITTLE else ">"
            (length,) = struct.unpack_from(f"{order}H", message, at + 2)
            end = at + 4 + length if length else len(message)
            if end > len(message):
                raise ValueError("a submessage ends after its message")
            body, at = message[at + 4 : end], end
            if kind == _INFO_TARGET:
                if len(body) < 12:
                    raise ValueError("a target that is too short")
                target = body[:12] if body[:12] != NOBODY else own
            elif kind == _INFO_SOURCE:
                if len(body) < 20:
                    raise ValueError("a source that is too short")
                vendor, prefix = body[6:8], body[8:20]
            elif target == own and (part := _part(kind, flags, order, body)) is not None:
                yield ReceivedSubmessage(prefix, vendor, part)
    except struct.error as error:
        raise ValueError(f"a submessage is too short: {error}") from error


def _part(kind: int, flags: int, order: str, body: bytes) -> Submessage | None:
    if kind in {_DATA, _FRAGMENT}:
        return _data(flags, order, body, is_fragment=kind == _FRAGMENT)
    reader, writer = body[:4], body[4:8]
    if kind == _HEARTBEAT:
        return Heartbeat(reader, writer, _number(order, body, 8), _number(order, body, 16), bool(flags & _FINAL))
    if kind == _ACKNACK:
        return AckNack(reader, writer, *_set(order, body, 8), bool(flags & _FINAL))
    if kind == _NACK_FRAGMENT:  # of a sample in parts, some are missing: all come again
        return AckNack(reader, writer, 0, [_number(order, body, 8)], is_final=True)
    if kind == _GAP:
        return Gap(reader, writer, _number(order, body, 8), *_set(order, body, 16))
    return None


def _data(flags: int, order: str, body: bytes, *, is_fragment: bool) -> Data:
    (skip,) = struct.unpack_from(f"{order}H", body, 2)
    reader, writer, number, at = body[4:8], body[8:12], _number(order, body, 12), 4 + skip
    found: dict[int, bytes] = {}
    if flags & _INLINE:
        found, at = parse_parameter_list(body, order, at)
    has_payload = bool(flags & (_PAYLOAD | _KEY)) and not is_fragment
    return Data(reader, writer, number, found, body[at:] if has_payload else None, is_fragment)


def _number(order: str, body: bytes, at: int) -> int:
    high, low = struct.unpack_from(f"{order}iI", body, at)
    if high > _HIGH_MOST:
        raise ValueError("a number that no writer counts to")
    return int(high) << 32 | int(low)


def _set(order: str, body: bytes, at: int) -> tuple[int, list[int]]:
    """Return a SequenceNumberSet (9.4.2.6): its base and its members."""
    base = _number(order, body, at)
    (count,) = struct.unpack_from(f"{order}I", body, at + 8)
    if count > _BITS_MOST:
        raise ValueError(f"a set of {count} numbers")
    words = struct.unpack_from(f"{order}{(count + 31) // 32}I", body, at + 12)
    return base, [base + k for k in range(count) if words[k // 32] >> (31 - k % 32) & 1]


def parse_parameter_list(body: bytes, order: str, at: int) -> tuple[dict[int, bytes], int]:
    """Return the parameters of a list (9.4.2.11) without their order, and where the list ends.

    Of a parameter that comes more than once, its values are joined.

    Raises
    ------
    ValueError
        The list has no end.
    """
    found: dict[int, bytes] = {}
    while at + 4 <= len(body):
        number, length = struct.unpack_from(f"{order}HH", body, at)
        at += 4
        if number == _SENTINEL:
            return found, at
        found[number] = found.get(number, b"") + body[at : at + length]
        at += length
    raise ValueError("a list of parameters without an end")


def parse_discovery_payload(payload: bytes) -> tuple[dict[int, bytes], str]:
    """Return the parameters of a payload of discovery, and the order of its bytes, ``<`` or ``>``.

    Raises
    ------
    ValueError
        The payload is no list of parameters.
    """
    if payload[:2] not in {b"\x00\x02", b"\x00\x03"}:
        raise ValueError("no list of parameters")
    order = "<" if payload[1] == 3 else ">"
    return parse_parameter_list(payload, order, 4)[0], order


def parse_locators(value: bytes, order: str) -> list[Address]:
    """Return the UDP addresses (IPv4) of locators (9.3.2.4); other kinds, such as shared memory, are left out."""
    found = []
    for at in range(0, len(value) - 23, 24):
        kind, port = struct.unpack_from(f"{order}iI", value, at)
        if kind == _UDP_V4 and 0 < port < 65536:
            found.append((str(ipaddress.IPv4Address(value[at + 20 : at + 24])), int(port)))
    return found


def parse_text(value: bytes, order: str) -> str:
    """Return a string of CDR.

    Raises
    ------
    ValueError
        It is no text, or shorter than it says.
    """
    if len(value) < 5:
        raise ValueError("a text that is too short")
    (length,) = struct.unpack_from(f"{order}I", value)
    if not 0 < length <= len(value) - 4:
        raise ValueError("a text that is too short")
    return value[4 : 3 + length].decode()


def build_message(prefix: bytes, target: bytes, parts: Iterable[bytes]) -> bytes:
    """Return a message of submessages for one participant, or with ``NOBODY`` for all."""
    aimed = [] if target == NOBODY else [_submessage(_INFO_TARGET, 0, target)]
    return b"".join([_MAGIC, _VERSION, bytes(2), prefix, *aimed, *parts])


def build_data(
    reader: bytes, writer: bytes, number: int, payload: bytes, inline: Sequence[tuple[int, bytes]] = (), *,
    is_key: bool = False,
) -> bytes:  # fmt: skip
    """Return a submessage with a sample, or with ``is_key`` with the key of what it tells of."""
    head = struct.pack("<HH", 0, 16) + reader + writer + _sequence_number(number)
    qos = build_parameter_list(inline) if inline else b""
    return _submessage(_DATA, (_KEY if is_key else _PAYLOAD) | (_INLINE if inline else 0), head + qos + payload)


def build_fragments(
    reader: bytes, writer: bytes, number: int, payload: bytes, inline: Sequence[tuple[int, bytes]], *, size: int
) -> list[bytes]:
    """Return the submessages with a sample in parts of at most ``size`` bytes (8.3.8.3)."""
    qos = build_parameter_list(inline) if inline else b""
    found = []
    for k, at in enumerate(range(0, len(payload), size)):
        head = struct.pack("<HH", 0, 28) + reader + writer + _sequence_number(number)
        body = head + struct.pack("<IHHI", k + 1, 1, size, len(payload)) + qos + payload[at : at + size]
        found.append(_submessage(_FRAGMENT, _INLINE if qos else 0, body))
    return found


def build_heartbeat(reader: bytes, writer: bytes, first: int, last: int, count: int) -> bytes:
    """Return a submessage that asks a reader what it misses."""
    body = reader + writer + _sequence_number(first) + _sequence_number(last) + struct.pack("<I", count)
    return _submessage(_HEARTBEAT, 0, body)


def build_acknack(
    reader: bytes, writer: bytes, base: int, missing: Sequence[int], count: int, *, is_final: bool
) -> bytes:
    """Return a submessage that tells a writer what a reader misses, at most 256 numbers from ``base`` on."""
    body = reader + writer + _numbers(base, missing) + struct.pack("<I", count)
    return _submessage(_ACKNACK, _FINAL if is_final else 0, body)


def build_gap(reader: bytes, writer: bytes, start: int, base: int) -> bytes:
    """Return a submessage by which samples from ``start`` until before ``base`` are of no concern."""
    return _submessage(_GAP, 0, reader + writer + _sequence_number(start) + _numbers(base, ()))


def build_parameter_list(values: Sequence[tuple[int, bytes]]) -> bytes:
    """Return a list of parameters with its end."""
    padded = [(number, value + bytes(-len(value) % 4)) for number, value in values]
    return b"".join(struct.pack("<HH", n, len(v)) + v for n, v in [*padded, (_SENTINEL, b"")])


def build_discovery_payload(values: Sequence[tuple[int, bytes]]) -> bytes:
    """Return a payload of discovery; the protocol's version is added."""
    return b"\x00\x03\x00\x00" + build_parameter_list([(VERSION, _VERSION), (VENDOR, bytes(2)), *values])


def build_locator(address: Address) -> bytes:
    """Return the locator of a UDP address (IPv4)."""
    return struct.pack("<iI", _UDP_V4, address[1]) + bytes(12) + ipaddress.IPv4Address(address[0]).packed


def build_text(value: str) -> bytes:
    """Return a string in CDR."""
    encoded = value.encode() + b"\x00"
    return struct.pack("<I", len(encoded)) + encoded


def build_sample_identity(guid: bytes, number: int) -> bytes:
    """Return the identity of a sample (24 bytes): its writer's guid and its number."""
    return guid + _sequence_number(number)


def _sequence_number(number: int) -> bytes:
    return struct.pack("<iI", number >> 32, number & 0xFFFFFFFF)


def _numbers(base: int, members: Sequence[int]) -> bytes:
    offsets = [number - base for number in members if 0 <= number - base < _BITS_MOST]
    count = max(offsets, default=-1) + 1
    words = [0] * ((count + 31) // 32)
    for k in offsets:
        words[k // 32] |= 1 << (31 - k % 32)
    return _sequence_number(base) + struct.pack(f"<I{len(words)}I", count, *words)


def _submessage(kind: int, flags: int, body: bytes) -> bytes:
    padded = body + bytes(-len(body) % 4)
    return struct.pack("<BBH", kind, flags | _LITTLE, len(padded)) + padded
