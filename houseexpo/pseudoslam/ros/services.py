"""Serve ROS 2 services to programs that use rmw_fastrtps or rmw_cyclonedds, without a ROS installation.

ROS 2 makes a service of two DDS topics: requests on ``rq/NAMERequest``, answers on ``rr/NAMEReply``. To know its answer
again, rmw_fastrtps puts the identity of the request beside the answer, into the inline QoS of DDS-RPC 1.0 (7.8.2), and
rmw_cyclonedds puts it before the answer, as 16 bytes. CycloneDDS cannot send such inline QoS. Therefore a participant
of its own serves here, which speaks as much of DDSI-RTPS 2.5 as that needs:

R1  It announces itself each second (8.5.3), by multicast and to the ports of this machine's participants.
R2  It tells each participant of its readers and writers, and learns of theirs (8.5.4).
R3  Readers and writers are reliable and keep state (8.4.9, 8.4.12): what is missing is asked for, and sent again.
R4  A request of a CycloneDDS participant has rmw_cyclonedds's 16 bytes before it; any other has its identity beside it.
R5  An answer goes only to who asked; other readers get a gap. It waits until the asking reader is known.

Requests that do not fit into one packet of 64 KiB are refused. Addresses are IPv4. There is no DDS Security.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.io.ros_messages import Fields, Message
from houseexpo.pseudoslam.ros import rtps
from houseexpo.pseudoslam.ros.idl import decode_message, encode_message
from houseexpo.pseudoslam.ros.threads import describe_error, start_lasting_thread

_CYCLONE: Final = b"\x01\x10"
"""Vendor of Eclipse CycloneDDS."""
_GROUP: Final = "239.255.0.1"
_PARTICIPANTS: Final = 60
"""The number of this machine's participants that are notified without multicast, as in CycloneDDS (see ``dds``)."""
_ANNOUNCE_S, _HEARTBEAT_S, _POLL_S = 1.0, 0.1, 0.05
_LEASE_S: Final = 20
_UNANSWERED_MOST: Final = 50
"""The number of unanswered heartbeats after which a reader gets no more."""
_ANSWERS_KEPT: Final = 100
"""The number of answers kept for readers that miss them."""
_PEERS_MOST, _LINKS_MOST, _WAITING_MOST = 256, 1000, 100
_WAIT_S: Final = 5.0
_PACKET: Final = 65_000
_FRAGMENT: Final = 32_000
"""Larger answers go in parts of this size."""
_PIECE: Final = 8_000
"""Size above which a packet takes no further submessage."""
_CALLS_MOST: Final = 100


class _Mail(NamedTuple):
    """Submessages for a participant."""

    prefix: bytes
    addresses: list[rtps.Address]
    parts: list[bytes]


@dataclass(eq=False)
class ServiceCall:
    """A request of a service; call ``answer`` once to answer it."""

    fields: Fields
    answer: Callable[[Fields], None]


class RequestQueue:
    """The received requests of a service that have not been taken yet."""

    def __init__(self) -> None:
        self._arrived: deque[ServiceCall] = deque(maxlen=_CALLS_MOST)

    def add(self, call: ServiceCall) -> None:
        """Add a request; called by the network's thread."""
        self._arrived.append(call)

    def take(self) -> list[ServiceCall]:
        """Return the requests since the last call, the oldest first."""
        found = []
        while self._arrived:
            found.append(self._arrived.popleft())
        return found


class ServiceServer:
    """A participant of a DDS domain that offers services.

    Parameters
    ----------
    domain
        The domain's number.
    local
        Whether to talk only to programs on this machine.
    warn
        Called with a sentence when a client does not fit or its request cannot be read.

    Raises
    ------
    ConfigError
        The network cannot be used.
    """

    def __init__(self, domain: int, *, local: bool, warn: Callable[[str], None]) -> None:
        self._warn, self._warned = warn, set[str]()
        self._prefix = bytes(2) + os.urandom(10)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("127.0.0.1" if local else "", 0))
        except OSError as error:
            self._socket.close()
            raise ConfigError(f"ROS 2 services: no port can be opened: {error}; check the network") from error
        self._socket.settimeout(_POLL_S)
        self._address = "127.0.0.1" if local else _own_address(), int(self._socket.getsockname()[1])
        first = 7400 + 250 * domain  # the ports of DDSI-RTPS 2.5, 9.6.1.1
        self._announced_to = [("127.0.0.1", first + 10 + 2 * k) for k in range(_PARTICIPANTS)]
        if not local:
            self._announced_to.append((_GROUP, first))
        self._lock = threading.RLock()
        self._peers: dict[bytes, _Peer] = {}
        self._offered: list[_Offered] = []
        self._told = _Writer(rtps.WRITERS_WRITER), _Writer(rtps.READERS_WRITER)
        self._learned = _Reader(rtps.WRITERS_READER), _Reader(rtps.READERS_READER)
        self._waiting: deque[tuple[float, _Offered, _Answer]] = deque(maxlen=_WAITING_MOST)
        self._closed = threading.Event()
        self._thread = start_lasting_thread(self._run, "ROS 2 services", closed=self._closed, warn=self._warn_once)

    def offer(self, name: str, kind: str) -> RequestQueue:
        """Offer a service of a ROS type, such as ``/houseexpo/reset`` and ``std_srvs/srv/Empty``."""
        with self._lock:
            made = _Offered(name, kind, len(self._offered) + 1)
            self._offered.append(made)
            writers, readers = self._told
            self._send(writers.add(rtps.build_discovery_payload(self._endpoint(made, "Reply"))))
            self._send(readers.add(rtps.build_discovery_payload(self._endpoint(made, "Request"))))
        return made.service

    def close(self) -> None:
        """Leave the domain; other participants are told."""
        self._closed.set()
        self._thread.join()
        key = rtps.build_discovery_payload([(rtps.PARTICIPANT_GUID, self._prefix + rtps.PARTICIPANT)])
        gone = rtps.build_data(rtps.SPDP_READER, rtps.SPDP_WRITER, 2, key, [(rtps.STATUS, b"\0\0\0\3")], is_key=True)
        with self._lock:
            self._send(_Mail(prefix, peer.meta, [gone]) for prefix, peer in self._peers.items())
        self._socket.close()

    def _endpoint(self, made: _Offered, part: str) -> list[tuple[int, bytes]]:
        """R2: the description of the writer of answers or the reader of requests."""
        prefix, entity = ("rr", made.answers.entity) if part == "Reply" else ("rq", made.requests.entity)
        return [
            (rtps.ENDPOINT_GUID, self._prefix + entity),
            (rtps.PARTICIPANT_GUID, self._prefix + rtps.PARTICIPANT),
            (rtps.TOPIC, rtps.build_text(f"{prefix}{made.name}{part}")),
            (rtps.TYPE, rtps.build_text(made.answer_type if part == "Reply" else made.request_type)),
            (rtps.RELIABILITY, struct.pack("<IiI", 2, 0, 1 << 29)),
            (rtps.DURABILITY, struct.pack("<I", 0)),
            (rtps.LOCATOR, rtps.build_locator(self._address)),
        ]

    def _run(self) -> None:
        announce = beat = 0.0
        while not self._closed.is_set():
            now = time.monotonic()
            with self._lock:
                if now >= announce:
                    announce = now + _ANNOUNCE_S
                    self._announce(self._announced_to)
                if now >= beat:
                    beat = now + _HEARTBEAT_S
                    for writer in (*self._told, *(each.answers for each in self._offered)):
                        self._send(writer.beat())
            try:
                packet, _ = self._socket.recvfrom(_PACKET + 536)
            except TimeoutError:
                continue
            except OSError:  # an answer of the system to an earlier packet
                time.sleep(_POLL_S)
                continue
            with self._lock:
                self._read(packet)

    def _announce(self, to: Iterable[rtps.Address]) -> None:
        """R1."""
        described = rtps.build_discovery_payload(
            [
                (rtps.PARTICIPANT_GUID, self._prefix + rtps.PARTICIPANT),
                (rtps.BUILTIN_SET, struct.pack("<I", rtps.BUILTIN)),
                (rtps.META_LOCATOR, rtps.build_locator(self._address)),
                (rtps.DEFAULT_LOCATOR, rtps.build_locator(self._address)),
                (rtps.LEASE, struct.pack("<iI", _LEASE_S, 0)),
            ]
        )
        part = rtps.build_data(rtps.SPDP_READER, rtps.SPDP_WRITER, 1, described)
        self._send([_Mail(rtps.NOBODY, list(to), [part])])

    def _send(self, mails: Iterable[_Mail]) -> None:
        for mail in mails:
            packet = rtps.build_message(self._prefix, mail.prefix, mail.parts)
            for address in mail.addresses:
                with contextlib.suppress(OSError):  # an address that is not reached from here; others of it may be
                    self._socket.sendto(packet, address)

    def _read(self, packet: bytes) -> None:
        """Process a packet; unknown parts are skipped, as RTPS requires (8.3.4.1)."""
        try:
            for each in rtps.parse_submessages(packet, self._prefix):
                if each.prefix == self._prefix:
                    continue
                if isinstance(each.part, rtps.Data):
                    self._take(each, each.part)
                elif isinstance(each.part, rtps.AckNack):
                    for writer in self._writers(each.part.writer):
                        self._send(writer.take_acknack(each.prefix + each.part.reader, each.part))
                else:
                    guid = each.prefix + each.part.writer
                    for reader in self._readers(guid, each.part.reader):
                        self._send(reader.take_part(guid, each.part))
        except ValueError:
            return
        except Exception as error:  # noqa: BLE001 - a packet from the network costs itself, whatever it holds
            self._warn_once(f"ROS 2 services: {describe_error(error)}: a packet was left out")

    def _writers(self, entity: bytes) -> Iterator[_Writer]:
        return (w for w in (*self._told, *(one.answers for one in self._offered)) if w.entity == entity)

    def _readers(self, guid: bytes, entity: bytes) -> Iterator[_Reader]:
        """Yield the readers of a writer; a reader that it names counts, even before the writer is announced."""
        for reader in (*self._learned, *(one.requests for one in self._offered)):
            if guid not in reader.writers and entity == reader.entity and guid[:12] in self._peers:
                self._send(reader.match(guid, self._peers[guid[:12]].user))
            if guid in reader.writers:
                yield reader

    def _take(self, each: rtps.ReceivedSubmessage, sample: rtps.Data) -> None:
        if sample.writer == rtps.SPDP_WRITER:
            self._meet(each, sample)
            return
        guid = each.prefix + sample.writer
        for reader in self._readers(guid, sample.reader):
            if not reader.is_new(guid, sample.number):
                continue
            if reader in self._learned:
                self._learn(each.prefix, sample)
                continue
            offered = next(one for one in self._offered if one.requests is reader)
            if sample.is_fragment:
                self._warn_once(
                    f"{offered.name}: expected a request of at most 64 KiB, found a larger one; it was left out"
                )
            elif sample.payload is not None:
                self._call(offered, each, sample)

    def _meet(self, each: rtps.ReceivedSubmessage, sample: rtps.Data) -> None:
        """R1: another participant came, or leaves."""
        if sample.payload is None or _is_gone(sample):
            self._forget(each.prefix)
            return
        if each.prefix in self._peers:
            return
        found, order = rtps.parse_discovery_payload(sample.payload)
        meta = rtps.parse_locators(found.get(rtps.META_LOCATOR, b""), order)
        if not meta:
            return
        while len(self._peers) >= _PEERS_MOST:
            self._forget(next(iter(self._peers)))
        self._peers[each.prefix] = _Peer(meta, rtps.parse_locators(found.get(rtps.DEFAULT_LOCATOR, b""), order) or meta)
        self._announce(meta)
        for writer, theirs in zip(self._told, (rtps.WRITERS_READER, rtps.READERS_READER), strict=True):
            self._send(writer.match(each.prefix + theirs, meta, from_first=True))
        for reader, theirs in zip(self._learned, (rtps.WRITERS_WRITER, rtps.READERS_WRITER), strict=True):
            self._send(reader.match(each.prefix + theirs, meta))

    def _forget(self, prefix: bytes) -> None:
        self._peers.pop(prefix, None)
        for one in (*self._told, *(each.answers for each in self._offered)):
            one.forget(prefix)
        for other in (*self._learned, *(each.requests for each in self._offered)):
            other.forget(prefix)

    def _learn(self, prefix: bytes, sample: rtps.Data) -> None:
        """R2: another participant has a reader or writer, or no longer."""
        if sample.payload is None:
            return
        found, order = rtps.parse_discovery_payload(sample.payload)
        guid, peer = found.get(rtps.ENDPOINT_GUID, sample.parameters.get(rtps.KEY_HASH, b"")), self._peers[prefix]
        if _is_gone(sample):
            for one in self._offered:
                one.answers.forget(guid)
                one.requests.forget(guid)
            return
        if len(guid) != 16 or rtps.TOPIC not in found or rtps.TYPE not in found:
            return
        topic, kind = rtps.parse_text(found[rtps.TOPIC], order), rtps.parse_text(found[rtps.TYPE], order)
        addresses = rtps.parse_locators(found.get(rtps.LOCATOR, b""), order) or peer.user
        for one in self._offered:
            if sample.writer == rtps.WRITERS_WRITER and topic == f"rq{one.name}Request":
                matched = one.requests.match(guid, addresses) if self._fits(one, kind, one.request_type) else []
            elif sample.writer == rtps.READERS_WRITER and topic == f"rr{one.name}Reply":
                matched = one.answers.match(guid, addresses) if self._fits(one, kind, one.answer_type) else []
            else:
                continue
            self._send(matched)
            self._answer_waiting()

    def _fits(self, offered: _Offered, found: str, expected: str) -> bool:
        if found != expected:
            self._warn_once(f"{offered.name}: a client's type does not fit: expected {expected}, found {found}")
        return found == expected

    def _warn_once(self, text: str) -> None:
        if text not in self._warned and len(self._warned) < _LINKS_MOST:
            self._warned.add(text)
            self._warn(text)

    def _call(self, offered: _Offered, each: rtps.ReceivedSubmessage, sample: rtps.Data) -> None:
        """R4."""
        payload, guid = sample.payload or b"", each.prefix + sample.writer
        reader, before, beside = None, b"", b""
        if each.vendor == _CYCLONE:
            payload, before = payload[:4] + payload[20:], payload[4:20]
        else:
            related = sample.parameters.get(rtps.RELATED) or sample.parameters.get(rtps.RELATED_OF_FAST_DDS) or b""
            if len(related) >= 16 and any(related[:16]):
                guid = reader = related[:16]
            beside = rtps.build_sample_identity(guid, sample.number)
        try:
            fields = decode_message(f"{offered.kind}_Request", payload)
        except ValueError as error:
            self._warn_once(f"{offered.name}: a request cannot be read: {error}")
            return

        def answer(fields: Fields) -> None:
            made = encode_message(Message(f"{offered.kind}_Response", fields))
            with self._lock:
                answered = _Answer(each.prefix, reader, made[:4] + before + made[4:], beside)
                self._waiting.append((time.monotonic() + _WAIT_S, offered, answered))
                self._answer_waiting()

        offered.service.add(ServiceCall(fields, answer))

    def _answer_waiting(self) -> None:
        """R5."""
        for _ in range(len(self._waiting)):
            until, offered, answer = self._waiting.popleft()
            start = answer.reader or answer.prefix
            to = {guid for guid in offered.answers.readers if guid.startswith(start)}
            if to:
                numbers = (rtps.RELATED, rtps.RELATED_OF_FAST_DDS) if answer.beside else ()
                inline = [(number, answer.beside) for number in numbers]
                self._send(offered.answers.add(answer.payload, inline, to))
            elif time.monotonic() < until:
                self._waiting.append((until, offered, answer))


def _own_address() -> str:
    """Return the address of the interface that multicast leaves by."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((_GROUP, 7400))
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])


def _is_gone(sample: rtps.Data) -> bool:
    """Whether a sample says that its instance is disposed or unregistered (9.6.3.9)."""
    return bool(sample.parameters.get(rtps.STATUS, b"\0\0\0\0")[3:4].strip(b"\0"))


@dataclass(frozen=True)
class _Peer:
    """Another participant: its addresses for discovery, and for user data."""

    meta: list[rtps.Address]
    user: list[rtps.Address]


@dataclass(frozen=True)
class _Answer:
    """An answer to a participant, or to its ``reader`` if that is known, with what stands beside it."""

    prefix: bytes
    reader: bytes | None
    payload: bytes
    beside: bytes


class _Offered:
    """A service: its topics' types, its reader and its writer."""

    def __init__(self, name: str, kind: str, number: int) -> None:
        self.name, self.kind, self.service = name, kind, RequestQueue()
        package, _, short = kind.split("/")
        self.request_type = f"{package}::srv::dds_::{short}_Request_"
        self.answer_type = f"{package}::srv::dds_::{short}_Response_"
        self.requests = _Reader(struct.pack(">I", number << 8 | 0x04))
        self.answers = _Writer(struct.pack(">I", number << 8 | 0x03))


@dataclass(frozen=True)
class _Sample:
    """A sample of a writer, for the readers in ``to``, or for all."""

    payload: bytes
    inline: list[tuple[int, bytes]]
    to: set[bytes] | None


@dataclass(eq=False)
class _Link:
    """A writer's state of a reader: its addresses, the first sample for it, and the first sample that it may lack."""

    addresses: list[rtps.Address]
    first: int
    lacks: int
    unanswered: int = 0


@dataclass(eq=False)
class _Writer:
    """R3: a reliable writer (8.4.9)."""

    entity: bytes
    readers: dict[bytes, _Link] = field(default_factory=dict)
    _samples: dict[int, _Sample] = field(default_factory=dict)
    _last: int = 0
    _beats: int = 0

    def match(self, guid: bytes, addresses: list[rtps.Address], *, from_first: bool = False) -> list[_Mail]:
        """Add a reader, which gets all samples or only those to come."""
        if guid in self.readers or len(self.readers) >= _LINKS_MOST:
            return []
        first = 1 if from_first else self._last + 1
        link = self.readers[guid] = _Link(addresses, first, first)
        return self._mails(guid, link, range(first, self._last + 1))

    def forget(self, start: bytes) -> None:
        """Remove the reader, or all readers of the participant."""
        for guid in [guid for guid in self.readers if start and guid.startswith(start)]:
            del self.readers[guid]

    def add(
        self, payload: bytes, inline: list[tuple[int, bytes]] | None = None, to: set[bytes] | None = None
    ) -> list[_Mail]:
        """Write a sample."""
        self._last += 1
        self._samples[self._last] = _Sample(payload, inline or [], to)
        self._samples.pop(self._last - _ANSWERS_KEPT, None)
        found = []
        for guid, link in self.readers.items():
            link.unanswered = 0
            found += self._mails(guid, link, [self._last])
        return found

    def take_acknack(self, guid: bytes, told: rtps.AckNack) -> list[_Mail]:
        """Process a reader's report on samples that it has and misses."""
        link = self.readers.get(guid)
        if link is None:
            return []
        link.lacks, link.unanswered = max(link.lacks, min(told.base, self._last + 1)), 0
        missing = [number for number in told.missing if number <= self._last]
        return [] if told.is_final and not missing else self._mails(guid, link, missing)

    def beat(self) -> list[_Mail]:
        """Return heartbeats for readers that have not confirmed all samples."""
        found = []
        for guid, link in self.readers.items():
            if link.lacks <= self._last and link.unanswered < _UNANSWERED_MOST:
                link.unanswered += 1
                found += self._mails(guid, link, [])
        return found

    def _mails(self, guid: bytes, link: _Link, numbers: Iterable[int]) -> list[_Mail]:
        """Return samples, or gaps, and a heartbeat."""
        reader, found, size = guid[12:], [list[bytes]()], 0
        for number in numbers:
            sample = self._samples.get(number)
            if sample is None or number < link.first or (sample.to is not None and guid not in sample.to):
                parts = [rtps.build_gap(reader, self.entity, number, number + 1)]
            elif len(sample.payload) > _FRAGMENT:
                parts = rtps.build_fragments(reader, self.entity, number, sample.payload, sample.inline, size=_FRAGMENT)
            else:
                parts = [rtps.build_data(reader, self.entity, number, sample.payload, sample.inline)]
            for part in parts:
                if found[-1] and size + len(part) > _PIECE:
                    found.append([])
                    size = 0
                found[-1].append(part)
                size += len(part)
        self._beats += 1
        first = max(link.first, min(self._samples, default=1))
        found[-1].append(rtps.build_heartbeat(reader, self.entity, first, self._last, self._beats))
        return [_Mail(guid[:12], link.addresses, parts) for parts in found]


@dataclass(eq=False)
class _Heard:
    """The samples that a reader has of a writer: all before ``next``, and ``later`` samples."""

    addresses: list[rtps.Address]
    next: int = 1
    later: set[int] = field(default_factory=set)

    def add(self, numbers: Iterable[int]) -> None:
        self.later.update(numbers)
        while self.later and (self.next in self.later or len(self.later) > _LINKS_MOST):
            self.skip_to(min(self.later) + 1)

    def skip_to(self, number: int) -> None:
        self.next = max(self.next, number)
        self.later = {one for one in self.later if one >= self.next}


@dataclass(eq=False)
class _Reader:
    """R3: a reliable reader (8.4.12), which gives samples in the order in which they come."""

    entity: bytes
    writers: dict[bytes, _Heard] = field(default_factory=dict)
    _answers: int = 0

    def match(self, guid: bytes, addresses: list[rtps.Address]) -> list[_Mail]:
        """Add a writer, and ask it for a heartbeat."""
        if guid in self.writers:
            self.writers[guid].addresses = addresses
            return []
        if len(self.writers) >= _LINKS_MOST:
            return []
        self.writers[guid] = _Heard(addresses)
        self._answers += 1
        asked = rtps.build_acknack(self.entity, guid[12:], 1, [], self._answers, is_final=False)
        return [_Mail(guid[:12], addresses, [asked])]

    def forget(self, start: bytes) -> None:
        """Remove the writer, or all writers of the participant."""
        for guid in [guid for guid in self.writers if start and guid.startswith(start)]:
            del self.writers[guid]

    def is_new(self, guid: bytes, number: int) -> bool:
        """Note the number of a sample; return whether it is new."""
        heard = self.writers[guid]
        if number < heard.next or number in heard.later:
            return False
        heard.add([number])
        return True

    def take_part(self, guid: bytes, part: rtps.Heartbeat | rtps.Gap | rtps.AckNack) -> list[_Mail]:
        """Process a writer's report on samples that it has or skips; return requests for missing samples."""
        heard = self.writers[guid]
        if isinstance(part, rtps.Gap):
            if part.start <= heard.next:
                heard.skip_to(part.base)
            else:
                heard.add(range(part.start, min(part.base, part.start + _LINKS_MOST)))
            heard.add(number for number in part.others if number >= heard.next)
        if not isinstance(part, rtps.Heartbeat):
            return []
        heard.skip_to(part.first)
        heard.add([])
        missing = [k for k in range(heard.next, min(part.last, heard.next + 255) + 1) if k not in heard.later]
        if part.is_final and not missing:
            return []
        self._answers += 1
        asked = rtps.build_acknack(self.entity, guid[12:], heard.next, missing, self._answers, is_final=not missing)
        return [_Mail(guid[:12], heard.addresses, [asked])]
