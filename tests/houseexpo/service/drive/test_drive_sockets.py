"""Sockets of robots: driven, watched, too slow, gone, hostile."""

from __future__ import annotations

import io
import json
import math
import threading
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette")
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from houseexpo import save_plan
from houseexpo.pseudoslam.kernels.compiling import CompilingProgress
from houseexpo.service import drive
from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.drive import sessions
from houseexpo.service.drive.messages import ENDED, SAVED
from houseexpo.service.drive.robots import DrivenRobot
from houseexpo.service.service import Service, ServiceSettings
from tests.builders.browsing import Frame, frame_from, painted, start, two_rooms
from tests.builders.services import no_plans

ADDRESS = "ws://127.0.0.1/houses/drive/robot"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder: Path = tmp_path_factory.mktemp("houses")
    save_plan(two_rooms(), folder / "two_rooms.json")
    service = Service({"houses": Collection("houses", folder)}, ServiceSettings(read_only=True))
    with TestClient(make_app(service), base_url="http://127.0.0.1") as found:
        yield found


def begun(socket: WebSocketTestSession, **words: Any) -> dict[str, Any]:
    socket.send_json(start(**words))
    while "preparing" in (told := socket.receive_json()):
        pass  # kernels are compiled
    assert set(told) == {"hello"}, told
    hello: dict[str, Any] = told["hello"]
    return hello


def next_bytes(socket: WebSocketTestSession) -> bytes:
    """Return what comes next that is no word of what takes long."""
    while "bytes" not in (message := socket.receive()):
        assert "preparing" in message["text"], message
    found: bytes = message["bytes"]
    return found


def next_frame(socket: WebSocketTestSession) -> Frame:
    found = frame_from(next_bytes(socket))
    socket.send_json({"do": "seen", "number": found.number})
    return found


def test_a_robot_is_driven_and_its_map_grows(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        hello = begun(socket)
        shown = np.zeros((hello["rows"], hello["cols"]), np.uint8)
        first = next_frame(socket)
        painted(shown, first)
        known = (shown > 0).sum()
        socket.send_json({"do": "move", "linear": 0.0, "angular": 1.0})
        for number in range(2, 30):
            frame = next_frame(socket)
            assert frame.number == number
            painted(shown, frame)
        assert (shown > 0).sum() > known
        assert math.remainder(frame.pose[2] - first.pose[2], math.tau) == pytest.approx(math.radians(3 * 28), abs=1e-3)
        assert len(frame.ranges) == hello["beams"]


@pytest.mark.slow
def test_an_explorer_is_watched_to_its_end_and_saved(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket, driver="frontier", seed=1)
        socket.send_json({"do": "pace", "steps_per_s": 30})
        frame = next_frame(socket)
        while not frame.flags & ENDED:
            frame = next_frame(socket)
        assert frame.coverage > 0.98
        figures = finished(socket)
        assert (figures["why"], figures["steps"]) == ("seen", frame.steps)
        socket.send_json({"do": "save"})
        data = next_bytes(socket)
        assert data[0] == SAVED
        assert "trajectory.csv" in zipfile.ZipFile(io.BytesIO(data[1:])).namelist()


def test_a_drive_is_finished_once(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket, seed=5)
        socket.send_json({"do": "move", "linear": 1.0, "angular": 0.25})
        last = next_frame(socket)
        while last.steps < 25:
            last = next_frame(socket)
        socket.send_json({"do": "finish"})
        figures = finished(socket)
        socket.send_json({"do": "finish"})  # once is enough
    assert figures["why"] == "you"
    assert figures["steps"] >= 25
    assert figures["time_s"] == pytest.approx(figures["steps"] / 30)


def finished(socket: WebSocketTestSession) -> dict[str, Any]:
    """Say of each frame that it is drawn until the figures come."""
    while True:
        message = socket.receive()
        if "bytes" in message:
            socket.send_json({"do": "seen", "number": frame_from(message["bytes"]).number})
        elif "finish" in message["text"]:
            found: dict[str, Any] = json.loads(message["text"])["finish"]
            return found


def test_what_takes_long_is_explained(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    is_told = threading.Event()

    def slow(*words: Any, **more: Any) -> DrivenRobot:
        is_told.wait(30)
        return DrivenRobot(*words, **more)

    monkeypatch.setattr(sessions, "DrivenRobot", slow)
    monkeypatch.setattr(sessions, "LONG_S", 0.1)
    monkeypatch.setattr(sessions, "TOLD_S", 0.2)
    monkeypatch.setattr(sessions, "compiling_progress", lambda: CompilingProgress(is_busy=True, functions=7))
    with client.websocket_connect(ADDRESS) as socket:
        socket.send_json(start())
        told = socket.receive_json()["preparing"]
        is_told.set()
        assert (told["compiling"], told["functions"]) == (True, 0)  # seven were done before this robot came
        assert told["seconds"] > 0


def test_an_explorer_takes_the_steps_that_were_asked_for(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket, driver="forward", seed=1)
        socket.send_json({"do": "pace", "steps_per_s": 120})
        frames = [next_frame(socket) for _ in range(12)]
        assert frames[-1].steps - frames[-5].steps == 16  # four a frame
        socket.send_json({"do": "pace", "steps_per_s": 30})
        frames = [next_frame(socket) for _ in range(12)]
        assert frames[-1].steps - frames[-5].steps == 4


def test_a_browser_that_is_behind_holds_its_robot(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        hello = begun(socket)
        socket.send_json({"do": "move", "linear": 0.0, "angular": 1.0})
        frames = [frame_from(next_bytes(socket)) for _ in range(sessions.WINDOW)]
        time.sleep(0.5)  # fifteen frames' time: none is made
        socket.send_json({"do": "seen", "number": frames[-1].number})
        following = next_frame(socket)
        assert following.number == frames[-1].number + 1
        turned = following.pose[2] - frames[-1].pose[2]
        assert turned == pytest.approx(np.radians(3.0), abs=1e-3)
        shown = np.zeros((hello["rows"], hello["cols"]), np.uint8)
        for frame in [*frames, following]:
            painted(shown, frame)
        assert (shown > 0).any()


def test_a_browser_that_draws_nothing_is_let_go(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket)
        monkeypatch.setattr(sessions, "GONE_S", 0.3)  # not before: on a full machine, the start comes later
        socket.send_json({"do": "move", "linear": 0.0, "angular": 1.0})
        for _ in range(sessions.WINDOW):
            next_bytes(socket)
        assert "stopped drawing" in socket.receive_json()["error"]
        with pytest.raises(WebSocketDisconnect):
            socket.receive_json()


def test_one_who_says_nothing_first_is_let_go(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "GONE_S", 0.2)
    with client.websocket_connect(ADDRESS) as socket:
        assert "expected a start" in socket.receive_json()["error"]


def test_nobody_there_ends_it(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket)
        next_frame(socket)
        monkeypatch.setattr(sessions, "LEFT_ALONE_S", 0.2)
        assert "Nobody drove" in socket.receive_json()["error"]


HOSTILE_STARTS = [
    "no json",
    '{"do":"start"}',
    '{"do":"start","plan":"two_rooms","driver":"os:system"}',
    '{"do":"start","plan":"../../etc/passwd"}',
    '{"do":"start","plan":"two_rooms","people":1000000}',
    '{"do":"start","plan":"two_rooms","range_m":1e308}',
    '{"do":"start","plan":"two_rooms","range_m":NaN}',
    '{"do":"start","plan":"two_rooms","what":1}',
    '{"do":"move","linear":1,"angular":0}',
    '{"do":"shutdown"}',
    "[" * 1900,
    "x" * 64_000,
]


@pytest.mark.parametrize("text", HOSTILE_STARTS)
def test_hostile_starts_are_answered_and_closed(client: TestClient, text: str) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        socket.send_text(text)
        assert socket.receive_json()["error"]
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_json()
        assert closed.value.code == sessions.REFUSED


HOSTILE_LATER = [
    '{"do":"move","linear":2,"angular":0}',
    '{"do":"seen","number":99999}',
    '{"do":"start","plan":"two_rooms"}',
    '{"do":"pace","steps_per_s":1e9}',
    '{"do":"finish","why":"seen"}',
    "null",
]


@pytest.mark.parametrize("text", HOSTILE_LATER)
def test_hostile_messages_are_answered_and_closed(client: TestClient, text: str) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket)
        next_frame(socket)
        socket.send_text(text)
        assert socket.receive_json()["error"]
        with pytest.raises(WebSocketDisconnect):
            socket.receive_json()


def test_bytes_and_floods_are_answered_and_closed(client: TestClient) -> None:
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket)
        next_frame(socket)
        socket.send_bytes(b"\x00\x01")
        assert "found bytes" in socket.receive_json()["error"]
    with client.websocket_connect(ADDRESS) as socket:
        begun(socket)
        next_frame(socket)
        for _ in range(3 * sessions.MAX_MESSAGES_A_S):
            socket.send_text('{"do":"seen","number":1}')
        assert "a second" in socket.receive_json()["error"]


def test_there_is_room_for_so_many_robots_and_for_more_when_they_go(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drive, "MAX_ROBOTS", 1)
    with client.websocket_connect(ADDRESS) as one:
        begun(one)
        with client.websocket_connect(ADDRESS) as other:
            assert "wait until" in other.receive_json()["error"]
    with client.websocket_connect(ADDRESS) as third:
        begun(third)


def test_the_page_names_plan_and_explorers(client: TestClient) -> None:
    page = client.get("/houses/drive").text
    assert "Drive in two_rooms" in page
    assert '<option value="frontier">' in page
    assert client.get("/houses/drive?plan=nothing").status_code == 404
    assert "<b>" not in client.get("/houses/drive?plan=<b>", headers={"accept": "text/html"}).text


def test_a_data_set_without_plans_has_no_page(tmp_path: Path) -> None:
    service = Service({"none": Collection("none", no_plans(tmp_path / "none"))})
    answer = TestClient(make_app(service), base_url="http://127.0.0.1").get("/none/drive")
    assert (answer.status_code, answer.json()["error"]) == (404, "none has no plans")
