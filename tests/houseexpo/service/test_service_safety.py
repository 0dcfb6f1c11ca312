"""Who may ask for what: hosts, tokens, other sites, read-only, limits."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import anyio
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from starlette.websockets import WebSocket, WebSocketDisconnect

from houseexpo.service.app import make_app
from houseexpo.service.guard import HEADERS, Guard, cookie_name
from houseexpo.service.service import ServerLimits, ServiceSettings, is_loopback
from tests.builders.services import BASE, service_of

WORD = "secret"
SOCKET = "ws://localhost:8000/socket"


def guard(settings: ServiceSettings, base: str = BASE) -> TestClient:
    """A client of an application that answers everything, behind the guard."""

    async def answer(request: Request) -> Response:
        await request.body()
        return PlainTextResponse("in")

    async def socket(opened: WebSocket) -> None:
        await opened.accept()
        await opened.send_text("in")
        with suppress(WebSocketDisconnect):
            await opened.receive_text()

    routes = [Route("/{path:path}", answer, methods=["GET", "POST"]), WebSocketRoute("/socket", socket)]
    return TestClient(Guard(Starlette(routes=routes), settings), base_url=base, follow_redirects=False)


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST.:1"])
def test_names_of_this_machine_are_let_in(host: str) -> None:
    assert guard(ServiceSettings()).get("/", headers={"host": host}).text == "in"


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "", "[::1", "a@b"]
)
def test_other_names_are_not(host: str) -> None:  # R1
    found = guard(ServiceSettings()).get("/", headers={"host": host})
    assert found.status_code == 421
    assert "Host header" in found.json()["error"]


def test_a_server_of_all_addresses_is_called_by_address_or_its_name_only() -> None:
    settings = ServiceSettings("0.0.0.0", names=("den",), token=WORD)  # noqa: S104
    client = guard(settings)
    shown = {"authorization": "Bearer secret"}
    for host in ("192.168.1.5:8000", "den", "Den:8000"):
        assert client.get("/", headers={"host": host, **shown}).status_code == 200
    assert client.get("/", headers={"host": "evil.example", **shown}).status_code == 421


def test_a_token_is_asked_for_and_moves_into_a_cookie() -> None:  # R2
    client = guard(ServiceSettings(token=WORD))
    assert client.get("/a").status_code == 401
    assert client.get("/a?token=secres").status_code == 401
    assert client.get("/a", headers={"cookie": f"{cookie_name(ServiceSettings())}=wrong"}).status_code == 401
    assert client.get("/a", headers={"authorization": "Bearer secret"}).text == "in"
    found = client.get("/a?x=1&token=secret")
    assert (found.status_code, found.headers["location"]) == (303, "/a?x=1")
    assert "HttpOnly" in found.headers["set-cookie"]
    assert client.get("/a").text == "in"  # the client keeps cookies


def test_servers_of_one_host_have_a_token_each() -> None:
    servers = [ServiceSettings(port=port, token=f"word{port}") for port in (8000, 8001)]
    kept: dict[str, str] = {}  # by name, as a browser keeps what comes from one host
    for each in servers:
        kept.update(guard(each).get(f"/a?token={each.token}").cookies)
    sent = {"cookie": "; ".join(f"{name}={value}" for name, value in kept.items())}
    assert [guard(each).get("/a", headers=sent).status_code for each in servers] == [200, 200]


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://["},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
def test_another_site_may_neither_write_nor_open_a_socket(headers: dict[str, str]) -> None:  # R3
    client = guard(ServiceSettings())
    assert client.post("/a", headers=headers).status_code == 403
    assert client.get("/a", headers=headers).status_code == 200
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(SOCKET, headers=headers):
        pass


def test_the_services_own_pages_and_programs_may() -> None:
    client = guard(ServiceSettings())
    own = {"origin": "http://localhost:8000", "sec-fetch-site": "same-origin"}
    assert client.post("/a", headers={**own, "host": "localhost:8000"}).text == "in"
    assert client.post("/a").text == "in"
    with client.websocket_connect(SOCKET) as opened:
        assert opened.receive_text() == "in"


def test_read_only_means_read_only() -> None:  # R4
    client = guard(ServiceSettings(read_only=True))
    assert client.post("/a").status_code == 403
    assert client.request("DELETE", "/a").status_code == 403
    assert client.get("/a").text == "in"


def test_sockets_are_counted_and_given_back() -> None:
    client = guard(ServiceSettings(limits=ServerLimits(sockets=1, sockets_per_client=1)))
    counted = client.app._sockets
    with client.websocket_connect(SOCKET) as one:
        assert list(counted.values()) == [1]
        one.receive_text()
        with pytest.raises(WebSocketDisconnect), client.websocket_connect(SOCKET):
            pass
        one.send_text("end")
    with client.websocket_connect(SOCKET) as again:
        assert again.receive_text() == "in"
        again.send_text("end")
    assert not counted


@pytest.mark.parametrize("content", [b"x" * 1001, (b"x" * 101 for _ in range(10))], ids=["declared", "in parts"])
def test_a_large_body_is_refused_in_words_that_scripts_read(folder: Path, content: Any) -> None:  # R6, R7
    service = service_of(folder, review=True, limits=ServerLimits(body_bytes=1000))
    client = TestClient(make_app(service), base_url=BASE)
    found = client.post("/homes/review/decide", content=content)
    assert found.status_code == 413
    assert found.json()["error"]
    assert found.headers.items() >= HEADERS.items()


def test_word_of_a_fault_has_the_same_headers(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:  # R6
    monkeypatch.setattr("houseexpo.service.collection.OpenedDataset.records", property(lambda _: 1 // 0))
    found = client.get("/api/homes/refused/picture.png", headers={"accept": "text/html"})
    assert (found.status_code, list(found.json())) == (500, ["error"])
    assert found.headers.items() >= HEADERS.items()


def test_every_answer_tells_the_browser_to_load_from_here_only() -> None:  # R6
    client = guard(ServiceSettings())
    for found in (client.get("/"), client.get("/", headers={"host": "evil.example"})):
        assert found.headers.items() >= HEADERS.items()


def test_a_client_that_leaves_in_the_middle_of_its_body_is_no_error(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    sent: list[dict[str, object]] = []
    parts = iter([{"type": "http.request", "body": b"{", "more_body": True}, {"type": "http.disconnect"}])

    async def receive() -> dict[str, object]:
        return next(parts)

    async def send(message: dict[str, object]) -> None:
        sent.append(message)

    scope = {
        "type": "http", "method": "POST", "path": "/homes/review/decide", "raw_path": b"/homes/review/decide",
        "query_string": b"", "headers": [(b"host", b"127.0.0.1")], "client": ("127.0.0.1", 1), "http_version": "1.1",
        "scheme": "http", "root_path": "", "server": ("127.0.0.1", 80),
    }  # fmt: skip
    anyio.run(make_app(service_of(folder, review=True)), scope, receive, send)
    assert sent[0]["status"] == 400
    assert not caplog.records


def test_loopback_is_known() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.9.9.9", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.1.1", "example.org", "")))  # noqa: S104


def test_no_path_leads_out(client: TestClient, tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_text("{}")
    for path in (
        "/api/homes/plans/..%2F..%2Fsecret",
        "/static/..%2Fapp.py",
        "/static/%2e%2e/app.py",
        "/homes/plan/..%2Fsecret.json",
        "/api/homes/splits/..%2F..%2Fx",
        "/api/homes/duplicates/..%2F..%2Fsecret/picture.png",
    ):
        assert client.get(path).status_code == 404, path
