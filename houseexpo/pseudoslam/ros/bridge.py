"""Carry topics of a ROS 2 graph over a rosbridge (v2.0, JSON on a websocket), where DDS cannot be had.

The operations are those of rosbridge_suite's ROSBRIDGE_PROTOCOL.md: ``advertise``, ``publish``, ``subscribe`` and
``status``. Numbers:

R1  An infinite range is written as 1e999, which is JSON, and infinite to its readers.
R2  JSON has no "not a number": a lost beam is 0, below ``range_min``, which LaserScan calls a range to be discarded.
R3  A type without fields is an empty object. In what comes, null is "not a number", and a missing field is 0 or empty.

If the connection breaks, the simulation goes on, its messages are lost, and the connection is tried again each second.
"""

from __future__ import annotations

import contextlib
import json
import math
import queue
import re
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, MissingDependencyError, install_command
from houseexpo.pseudoslam.io.ros_messages import FIELDS, Fields, Message, TopicQuality, empty_fields
from houseexpo.pseudoslam.ros.dds import Subscription

_RETRY_S: Final = 1.0
"""The time before a connection is tried again, and a thread that failed begins again, seconds."""
_ERROR_LETTERS: Final = 200
"""The most characters of an error's text."""
_CLOSE_S, _POLL_S = 1.0, 0.2
_OPTIONS: Final[dict[str, Any]] = {
    "open_timeout": 5.0, "close_timeout": _CLOSE_S, "max_size": 16 * 2**20, "compression": None, "proxy": None
}  # fmt: skip
_WAITING_MOST: Final = 200
"""The most messages that wait for a slow server; further messages are dropped."""
_NO_FIELDS: Final = "structure_needs_at_least_one_member"
_OUTSIDE_TEXT: Final = re.compile(r'"(?:[^"\\]|\\.)*"|-?Infinity|NaN')
_NUMBERS: Final = {"Infinity": "1e999", "-Infinity": "-1e999", "NaN": "0.0"}


class Bridge:
    """A client of a rosbridge, with the graph that a node needs.

    Parameters
    ----------
    url
        Where the rosbridge listens, such as ``ws://localhost:9090``.
    warn
        Called with a sentence when the connection breaks or comes back, and when the rosbridge reports an error.

    Raises
    ------
    ConfigError
        No server answers there, or it is not the address of a websocket.
    MissingDependencyError
        websockets is not installed.
    """

    def __init__(self, url: str, *, warn: Callable[[str], None]) -> None:
        try:
            import websockets.sync.client
        except ImportError as error:
            said = f"a rosbridge needs websockets, which is not installed: {install_command('bridge')}"
            raise MissingDependencyError(said) from error
        self.url, self._warn, self._warned = url, warn, set[str]()
        self._kinds: dict[str, str] = {}
        self._latched: set[str] = set()
        self._heard: dict[str, Subscription] = {}
        if not re.match(r"wss?://[^\s/]", url):
            raise ConfigError(f"bridge: expected an address such as ws://localhost:9090, found {url!r}")
        self._line = _Line(url, websockets.sync.client.connect, self._take, warn, self._warn_once)

    def advertise(self, topic: str, kind: str, quality: TopicQuality) -> None:
        """Offer messages of a type on a topic, such as ``/robot1/scan``."""
        self._kinds[topic] = kind
        if quality.latched:
            self._latched.add(topic)
        asked = {"topic": topic, "type": kind, "latch": quality.latched, "queue_size": quality.depth}
        self._line.greet({"op": "advertise", **asked})

    def publish(self, topic: str, message: Message) -> None:
        """Send a message on a topic that was advertised; while there is no connection, it is lost, unless latched."""
        assert message.type == self._kinds[topic], (topic, message.type)  # noqa: S101  # our own topics
        latch = topic in self._latched
        asked = {"op": "publish", "topic": topic, "msg": _object(message.type, message.fields), "latch": latch}
        self._line.send(_json(asked), topic, keep=latch)

    def has_subscribers(self, topic: str) -> bool:
        """Return True, since a rosbridge does not report subscribers."""
        return topic in self._kinds

    def subscribe(self, topic: str, kind: str, quality: TopicQuality | None = None) -> Subscription:
        """Listen to messages of a type on a topic; a rosbridge hears only one type on a topic, the first asked for."""
        subscription = Subscription(kind)
        if topic not in self._heard:
            self._heard[topic] = subscription
            depth = (quality or TopicQuality()).depth
            self._line.greet(
                {"op": "subscribe", "id": f"subscribe:{topic}", "topic": topic, "type": kind, "queue_length": depth}
            )
        return subscription

    def look(self) -> None:
        """Do nothing: a rosbridge does not report other participants."""

    def close(self) -> None:
        """Take the topics back, and leave."""
        for topic in self._kinds:
            self._line.send(_json({"op": "unadvertise", "topic": topic}), topic)
        self._line.close()

    def _warn_once(self, text: str) -> None:
        if text not in self._warned and len(self._warned) < _WAITING_MOST:
            self._warned.add(text)
            self._warn(text)

    def _take(self, operation: object, found: dict[str, Any]) -> None:
        if operation == "publish" and found.get("topic") in self._heard:
            subscription = self._heard[found["topic"]]
            try:
                subscription.add(_fields(subscription.kind, found.get("msg"), "msg"))
            except ValueError as error:
                self._warn_once(f"{found['topic']}: {error}; it was left out")


class _Line:
    """A connection to a rosbridge, which is tried again each second when it breaks.

    Parameters
    ----------
    take
        Called with the operation and the complete message of the rosbridge, except for status messages.
    warn, warn_once
        Called with a sentence when the connection breaks or comes back, and with sentences to report only once.

    Raises
    ------
    ConfigError
        Nobody answers there.
    """

    def __init__(
        self,
        url: str,
        connect: Callable[..., Any],
        take: Callable[[object, dict[str, Any]], None],
        warn: Callable[[str], None],
        warn_once: Callable[[str], None],
    ) -> None:
        self._url, self._connect, self._take, self._warn, self._warn_once = url, connect, take, warn, warn_once
        self._greetings: list[dict[str, Any]] = []
        self._kept: dict[str, str] = {}
        self._outgoing: queue.Queue[str] = queue.Queue(_WAITING_MOST)
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._connection: Any = None
        self._connections = 0
        first: queue.Queue[Exception | None] = queue.Queue()
        self._threads = [
            _start_lasting_thread(
                partial(self._stay, first.put), f"{url}: listening", closed=self._closed, warn=warn_once
            ),
            _start_lasting_thread(self._write_all, f"{url}: sending", closed=self._closed, warn=warn_once),
        ]
        if (refused := first.get()) is not None:
            self._closed.set()
            said = f"bridge: no rosbridge answers at {url}: {refused}; start rosbridge_server there"
            raise ConfigError(said) from refused

    def greet(self, operation: dict[str, Any]) -> None:
        """Send a message now and again on each new connection."""
        with self._lock:
            self._greetings.append(operation)
        self.send(_json(operation), operation["op"])

    def send(self, said: str, of: str, *, keep: bool = False) -> None:
        """Send a message of a topic; with ``keep``, send it again on each new connection."""
        with self._lock:
            if keep:
                self._kept[of] = said
            if self._connection is None:
                return
        try:
            self._outgoing.put_nowait(said)
        except queue.Full:
            self._warn_once(f"{self._url}: the rosbridge is too slow, messages of {of} are dropped")

    def close(self) -> None:
        """Send the waiting messages, and close the connection."""
        self._closed.set()
        self._threads[1].join(_CLOSE_S + _POLL_S)
        with self._lock:
            connection = self._connection
        if connection is not None:
            connection.close()
        self._threads[0].join(_CLOSE_S + _POLL_S)

    def _write_all(self) -> None:
        while not (self._closed.is_set() and self._outgoing.empty()):
            with contextlib.suppress(queue.Empty):
                said = self._outgoing.get(timeout=_POLL_S)
                with self._lock:
                    connection = self._connection
                if connection is not None:
                    with contextlib.suppress(OSError, _refusals()):  # the reader sees it too
                        connection.send(said)

    def _stay(self, first: Callable[[Exception | None], None]) -> None:
        """Connect and read until closed; ``first`` is called with how the first attempt ended."""
        while not self._closed.is_set():
            error: Exception | None = None
            try:
                with self._connect(self._url, **_OPTIONS) as connection:
                    self._meet(connection)
                    self._connections += 1
                    if self._connections == 1:
                        first(None)
                    else:
                        self._warn(f"{self._url}: connected again")
                    for said in connection:
                        self._read(said)
            except (OSError, _refusals()) as caught:
                error = caught
            if self._connections == 0:
                first(error)
                return
            with self._lock:
                was, self._connection = self._connection, None
            if was is not None and not self._closed.is_set():
                self._warn(f"{self._url}: the connection broke: {error or 'it was closed'}; trying again each second")
            self._closed.wait(_RETRY_S)

    def _meet(self, connection: Any) -> None:
        """Repeat the kept messages on a new connection, and drop messages that were meant for the old connection."""
        with self._lock:
            for operation in self._greetings:
                connection.send(_json(operation))
            for said in self._kept.values():
                connection.send(said)
            with contextlib.suppress(queue.Empty):
                while True:
                    self._outgoing.get_nowait()
            self._connection = connection

    def _read(self, said: str | bytes) -> None:
        """Process a message of the rosbridge; operations that are not meant for clients are ignored."""
        try:
            found = json.loads(said)
        except (ValueError, RecursionError):
            self._warn_once(f"{self._url}: expected JSON, found {said[:40]!r}; check that it is a rosbridge")
            return
        operation = found.get("op") if isinstance(found, dict) else None
        try:
            if operation == "status" and found.get("level") in {"error", "warning"}:
                self._warn_once(f"{self._url}: the rosbridge reports: {str(found.get('msg', ''))[:500]}")
            elif operation is not None:
                self._take(operation, found)
        except Exception as error:  # noqa: BLE001 - a message from the network costs itself, whatever it holds
            self._warn_once(f"{self._url}: {_describe_error(error)}: {said[:40]!r} was left out")


def _start_lasting_thread(
    work: Callable[[], None], name: str, *, closed: threading.Event, warn: Callable[[str], None]
) -> threading.Thread:
    """Start a daemon thread that does ``work`` until it returns, and begins it again a second after an error.

    Parameters
    ----------
    name
        What the thread does, for the sentence that ``warn`` gets.
    closed
        Set by whoever needs the thread no longer.
    """

    def last() -> None:
        while True:
            try:
                work()
            except Exception as error:  # noqa: BLE001 - whatever it was, the command goes on and needs its network
                warn(f"{name}: {_describe_error(error)}; it begins again in {_RETRY_S:g} s")
            else:
                return
            if closed.wait(_RETRY_S):
                return

    thread = threading.Thread(target=last, name=name, daemon=True)
    thread.start()
    return thread


def _describe_error(error: Exception) -> str:
    """Return the kind and the text of an error in one short line."""
    return f"{type(error).__name__}: {error}"[:_ERROR_LETTERS]


def _refusals() -> type[Exception]:
    from websockets.exceptions import WebSocketException

    return WebSocketException


def _json(value: Any) -> str:
    """R1, R2."""
    return _OUTSIDE_TEXT.sub(lambda found: _NUMBERS.get(found[0], found[0]), json.dumps(value, separators=(",", ":")))


def _object(kind: str, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return a message as JSON's values (R3)."""
    return {name: _value(FIELDS[kind][name], value) for name, value in fields.items() if name != _NO_FIELDS}


def _value(kind: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return _object(kind, value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [_value(kind.removesuffix("[]"), one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def _fields(kind: str, found: Any, where: str) -> Fields:
    """Return the fields of a message of JSON's values (R3).

    Raises
    ------
    ValueError
        A field has another type.
    """
    if not isinstance(found, dict):
        raise ValueError(f"{where}: expected an object of {kind}, found {_short(found)}")  # noqa: TRY004  # of JSON
    unknown = sorted(set(found) - set(FIELDS[kind]))
    if unknown:
        raise ValueError(f"{where}: expected fields of {kind}, found {unknown[0]!r}")
    given = {name: _plain(FIELDS[kind][name], value, f"{where}.{name}") for name, value in found.items()}
    return {**empty_fields(kind), **given}


def _plain(kind: str, value: Any, where: str) -> Any:
    if kind in FIELDS:
        return _fields(kind, value, where)
    inner, bracket, size = kind.partition("[")
    if bracket:
        if not isinstance(value, list) or (size != "]" and len(value) != int(size[:-1])):
            raise ValueError(f"{where}: expected {kind}, found {_short(value)}")
        return [_plain(inner, one, where) for one in value]
    if inner.startswith("float") and (
        value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    ):
        return math.nan if value is None else float(value)
    expected = {"string": str, "bool": bool}.get(inner, int)
    fits = type(value) is expected and not inner.startswith("float")
    if not fits or (expected is int and not np.iinfo(inner).min <= value <= np.iinfo(inner).max):
        raise ValueError(f"{where}: expected {inner}, found {_short(value)}")
    return value


def _short(value: Any) -> str:
    return repr(value)[:40]
