"""Connections that are held for nothing are closed, and none that is used."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import anyio
import pytest

pytest.importorskip("uvicorn")

import uvicorn
from websockets.sync.client import connect

from houseexpo.service import guard

IDLE_TIMEOUT_S = 0.3
HEAD = b"GET / HTTP/1.1\r\nHost: localhost\r\n"


async def app(scope: dict[str, Any], receive: Any, send: Any) -> None:
    """Answer after three times the patience; over a socket, say back what was said."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        await send({"type": "websocket.send", "text": (await receive())["text"]})
        await receive()
        return
    if scope["path"] == "/body":
        while (await receive()).get("more_body"):
            pass
    if scope["path"] == "/slow":
        await anyio.sleep(3 * IDLE_TIMEOUT_S)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"in"})


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.setattr(guard, "IDLE_TIMEOUT_S", IDLE_TIMEOUT_S)
    config = uvicorn.Config(app, http=guard.LimitedProtocol, log_level="error", lifespan="off", ws="websockets-sansio")
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        yield listening.getsockname()[1]
        server.should_exit = True
        thread.join(10)


def asking(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=30)


@pytest.mark.parametrize("sent", [b"", b"GET", HEAD])
def test_without_a_whole_request_it_is_closed(port: int, sent: bytes) -> None:  # R1
    with asking(port) as client:
        client.sendall(sent)
        assert client.recv(1) == b""


def test_after_an_answer_a_part_of_a_request_does_not_hold_it(port: int) -> None:  # R1
    with asking(port) as client:
        client.sendall(HEAD + b"\r\n" + b"GET")
        answer = b""
        while part := client.recv(1000):
            answer += part
        assert answer.endswith(b"\r\n\r\nin")


def test_an_answer_that_takes_long_is_waited_for(port: int) -> None:
    with asking(port) as client:
        client.sendall(b"GET /slow HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert client.recv(1000).startswith(b"HTTP/1.1 200")


def test_a_socket_stays_open(port: int) -> None:
    with connect(f"ws://127.0.0.1:{port}/") as opened:
        time.sleep(3 * IDLE_TIMEOUT_S)
        opened.send("still there")
        assert opened.recv() == "still there"


def test_an_address_has_so_many_connections(port: int, monkeypatch: pytest.MonkeyPatch) -> None:  # R2
    monkeypatch.setattr(guard, "IDLE_TIMEOUT_S", 60.0)
    monkeypatch.setattr(guard, "MAX_PER_ADDRESS", 3)
    with ExitStack() as held:
        for _ in range(3):
            assert answers(held.enter_context(asking(port)))
        with asking(port) as more:
            assert more.recv(1) == b""
    for _ in range(100):  # they are given back
        with asking(port) as client:
            if answers(client):
                return
        time.sleep(0.05)
    raise TimeoutError


def answers(client: socket.socket) -> bool:
    try:
        client.sendall(HEAD + b"\r\n")
        return client.recv(1000).startswith(b"HTTP/1.1 200")
    except OSError:  # it was cut off
        return False


@pytest.mark.parametrize("drip", [False, True])
def test_a_body_that_never_comes_holds_no_connection(port: int, *, drip: bool) -> None:  # R1
    with asking(port) as client:
        client.sendall(b"POST /body HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n")
        client.settimeout(0.1)
        limit = time.monotonic() + 30  # seconds: a full machine is late
        while True:
            assert time.monotonic() < limit
            try:
                if drip:
                    client.sendall(b"x")
                if client.recv(100) == b"":
                    break
            except TimeoutError:
                continue
            except ConnectionError:
                break
