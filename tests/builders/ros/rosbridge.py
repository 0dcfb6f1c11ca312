"""A rosbridge for tests: a websocket server that follows rosbridge v2.0 to the letter, with a graph of its own.

It knows the operations that a robot needs (ROSBRIDGE_PROTOCOL.md, 3.3): what breaks the protocol (no JSON, a field
that is missing or of another type, a message on a topic that was not advertised) is kept in ``faults`` and answered by
a status.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

NEEDED: dict[str, dict[str, type]] = {
    "advertise": {"topic": str, "type": str},
    "unadvertise": {"topic": str},
    "publish": {"topic": str, "msg": dict},
    "subscribe": {"topic": str},
}
OPTIONAL: dict[str, dict[str, type]] = {
    "advertise": {"id": str, "latch": bool, "queue_size": int},
    "publish": {"id": str, "latch": bool, "queue_size": int},
    "subscribe": {
        "id": str,
        "type": str,
        "throttle_rate": int,
        "queue_length": int,
        "fragment_size": int,
        "compression": str,
    },
}


class Rosbridge:
    """A context manager; ``heard`` has each topic's messages, ``publish`` is another node.

    As in rosbridge_suite, what comes on a connection is taken in its order, and a message goes to the connection that
    subscribed.
    """

    def __init__(self, port: int = 0) -> None:
        self.heard: dict[str, list[dict[str, Any]]] = {}
        self.topics: dict[str, tuple[str, bool]] = {}
        self.subscribed: dict[str, str] = {}
        self.faults: list[str] = []
        self._clients: list[ServerConnection] = []
        self._listeners: dict[str, ServerConnection] = {}
        self._server: Server = serve(self._serve, "127.0.0.1", port)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

    def __enter__(self) -> Rosbridge:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        for client in self._clients:
            client.close()
        self._thread.join(10.0)

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        assert topic in self.subscribed
        self._listeners[topic].send(json.dumps({"op": "publish", "topic": topic, "msg": message}))

    def say(self, text: str) -> None:
        """Send what need not be of the protocol, on the connection that came first."""
        self._clients[0].send(text)

    def wait(self, until: Callable[[], bool], limit_s: float = 20.0) -> None:
        end = time.monotonic() + limit_s
        while not until():
            assert time.monotonic() < end, (self.topics, self.faults)
            time.sleep(0.005)

    def _serve(self, client: ServerConnection) -> None:
        self._clients.append(client)
        for said in client:
            fault = self._take(said, client)
            if fault:
                self.faults.append(fault)
                try:
                    client.send(json.dumps({"op": "status", "level": "error", "msg": fault}))
                except ConnectionClosed:
                    return

    def _take(self, said: str | bytes, client: ServerConnection) -> str:
        """Carry an operation out; return what is wrong with it, or "" if nothing is."""

        def refuse(text: str) -> None:
            raise ValueError(f"{text} is not JSON")

        try:
            found = json.loads(said, parse_constant=refuse)
        except ValueError as error:
            return str(error)
        operation = found.pop("op", None)
        if operation not in NEEDED:
            return f"unknown operation {operation}"
        needed, known = NEEDED[operation], NEEDED[operation] | OPTIONAL.get(operation, {})
        wrong = [name for name in needed if name not in found]
        wrong += [name for name, value in found.items() if name not in known or type(value) is not known[name]]
        if wrong:
            return f"{operation}: {wrong[0]}: {found.get(wrong[0])!r}"
        if operation == "subscribe":
            self._listeners[found["topic"]] = client
        getattr(self, f"_{operation}")(**found)
        return self._fault.pop() if self._fault else ""

    @property
    def _fault(self) -> list[str]:
        return self.__dict__.setdefault("_fault_now", [])  # type: ignore[no-any-return]

    def _advertise(self, topic: str, type: str, latch: bool = False, **_: Any) -> None:  # noqa: A002  # its name there
        if topic in self.topics and self.topics[topic][0] != type:
            self._fault.append(f"{topic} has the type {self.topics[topic][0]}, not {type}")
        self.topics[topic] = type, latch

    def _unadvertise(self, topic: str) -> None:
        self.topics.pop(topic, None)

    def _publish(self, topic: str, msg: dict[str, Any], **_: Any) -> None:
        if topic not in self.topics:
            self._fault.append(f"{topic} is not advertised")
        self.heard.setdefault(topic, []).append(msg)

    def _subscribe(self, topic: str, type: str, **_: Any) -> None:  # noqa: A002
        self.subscribed[topic] = type
