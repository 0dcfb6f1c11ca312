"""Admit or refuse each request and socket before a page sees it, by its host, token, origin and size.

It is pure ASGI, so that it guards sockets as well as requests.

R1  The Host header must name this server (``ServiceSettings.knows``). Another name that leads here is an attack.
R2  If a token is set, every request must show it: as a cookie, as ``Authorization: Bearer``, or once as ``?token=``,
    which sets the cookie. It is compared in constant time. The cookie's name contains the port, because browsers share
    cookies between the servers of a host.
R3  Requests that write, and sockets, must come from the service's own pages or from a program: an ``Origin`` must be
    this server, and ``Sec-Fetch-Site`` must be same-origin or none.
R4  A read-only service refuses every request that writes.
R5  A client has a limited number of open sockets, and so has the server.
R6  Every answer, including errors, tells browsers to load content only from this server, and not to show the page in a
    frame of another site.
R7  A request that announces a larger body than is allowed is refused before it is read.
R8  A connection is closed if no request began since the last look and none is being answered; two looks take place in
    ``IDLE_TIMEOUT_S``. An incomplete head is not a request. Neither is a request whose body is incomplete at the second
    look: bodies are small here, and one that never arrives would occupy a worker. (uvicorn limits only the time after
    an answer.)
R9  An address has a limited number of connections. With R8, no client without the token can use up all file
    descriptors.
"""

from __future__ import annotations

import asyncio
import secrets
from collections import Counter
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qsl, urlencode, urlsplit

import msgspec
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from houseexpo.service.service import ServiceSettings

_READS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_LENGTH_DIGITS: Final = 18
"""Digits of a length that are read; more would only cost time."""
_OF_COOKIE: Final = f"Path=/; Max-Age={30 * 24 * 3600}; HttpOnly; SameSite=Strict"

HEADERS: Final = {
    "content-security-policy": (
        "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'self'; "
        "frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}


class Refusal(NamedTuple):
    """The answer to a request that is refused."""

    status: int
    text: str
    headers: Mapping[str, str] = MappingProxyType({})


class Guard:
    """Passes a request or a socket on, or refuses it. It is the outermost layer, so that errors pass through it too."""

    def __init__(self, app: ASGIApp, settings: ServiceSettings) -> None:
        self._app, self._settings = app, settings
        self._sockets: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request, one socket, or the start and end of the server."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers, client = Headers(scope=scope), (scope.get("client") or ("", 0))[0]
        refusal = self._refuse_stranger(scope, headers) or self._refuse_write(scope, headers)
        refusal = refusal or self._refuse_overload(scope, headers, client)
        if refusal is not None:
            await _answer(refusal, scope, receive, send)
        elif scope["type"] == "websocket":
            await self._socket(scope, receive, send, client)
        else:
            await self._app(scope, receive, _with_headers(send))

    def _refuse_stranger(self, scope: Scope, headers: Headers) -> Refusal | None:
        token = self._settings.token
        if not self._settings.knows(_without_port(headers.get("host", ""))):  # R1
            text = "The Host header names another server. Use the address that houseexpo serve printed."
            return Refusal(421, text)
        if not token or _shows_token(scope, headers, self._settings):  # R2
            return None
        if scope["type"] == "http" and (there := _with_token(scope, self._settings)) is not None:
            return Refusal(303, "", there)
        text = "This server requires a token. Open the address that houseexpo serve printed; it contains the token."
        return Refusal(401, text, {"www-authenticate": "Bearer"})

    def _refuse_write(self, scope: Scope, headers: Headers) -> Refusal | None:
        writes = scope["type"] == "http" and scope["method"] not in _READS
        if (writes or scope["type"] == "websocket") and not _is_same_origin(headers):  # R3
            return Refusal(403, "Only the pages of this server may do this; the request came from another site.")
        if writes and self._settings.read_only:  # R4
            return Refusal(403, "This service is read-only. Nothing was changed.")
        return None

    def _refuse_overload(self, scope: Scope, headers: Headers, client: str) -> Refusal | None:
        most, length = self._settings.limits.body_bytes, headers.get("content-length", "")
        if length.isdecimal() and int(length[:_LENGTH_DIGITS]) > most:  # R7
            return Refusal(413, f"A request may have at most {most:,} bytes.", {"connection": "close"})
        if scope["type"] == "websocket" and self._has_no_socket_left(client):  # R5
            return Refusal(503, "Too many open sockets; close another page of this service.", {"retry-after": "5"})
        return None

    def _has_no_socket_left(self, client: str) -> bool:
        limits = self._settings.limits
        return self._sockets.total() >= limits.sockets or self._sockets[client] >= limits.sockets_per_client

    async def _socket(self, scope: Scope, receive: Receive, send: Send, client: str) -> None:
        self._sockets[client] += 1
        try:
            await self._app(scope, receive, send)
        finally:
            self._sockets[client] -= 1
            if not self._sockets[client]:
                del self._sockets[client]  # a zero of each address would stay


def _without_port(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def cookie_name(settings: ServiceSettings) -> str:
    """Return the name of the cookie with a server's token."""
    return f"houseexpo-token-{settings.port}"


def _shows_token(scope: Scope, headers: Headers, settings: ServiceSettings) -> bool:
    given = [cookie_parser(headers.get("cookie", "")).get(cookie_name(settings), "")]
    kind, _, value = headers.get("authorization", "").partition(" ")
    given += [value.strip()] if kind.lower() == "bearer" else []
    given += [value for name, value in _query(scope) if name == "token"] if scope["type"] == "websocket" else []
    return any(secrets.compare_digest(each.encode(), settings.token.encode()) for each in given)


def _with_token(scope: Scope, settings: ServiceSettings) -> dict[str, str] | None:
    """Return headers that redirect an address with the token to the same address without it, and set the cookie."""
    query = _query(scope)
    given = [value for name, value in query if name == "token"]
    if not any(secrets.compare_digest(each.encode(), settings.token.encode()) for each in given):
        return None
    rest = urlencode([(name, value) for name, value in query if name != "token"])
    path = "/" + scope["raw_path"].decode("latin-1").split("?")[0].lstrip(
        "/"
    )  # "//elsewhere" would lead to another server
    cookie = f"{cookie_name(settings)}={settings.token}; {_OF_COOKIE}"
    return {"location": path + (f"?{rest}" if rest else ""), "set-cookie": cookie, "cache-control": "no-store"}


def _query(scope: Scope) -> list[tuple[str, str]]:
    return parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)


def _is_same_origin(headers: Headers) -> bool:
    if headers.get("sec-fetch-site", "none") not in {"same-origin", "none"}:
        return False
    origin = headers.get("origin")
    return origin is None or _place_of(origin) == headers.get("host", "").lower()


def _place_of(origin: str) -> str | None:
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:  # "http://[" is no address of this server
        return None


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            found = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                found.setdefault(name, value)  # R6
        await send(message)

    return send_with_headers


async def _answer(refusal: Refusal, scope: Scope, receive: Receive, send: Send) -> None:
    """Refuse a request; a socket is closed before it opens, which its client sees as status 403."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": refusal.text[:100]})
        return
    body = msgspec.json.encode({"error": refusal.text}) if refusal.text else b""
    own = {"content-type": "application/json", "content-length": str(len(body))}
    found: dict[str, Any] = {**HEADERS, **own, **refusal.headers}
    raw = [(name.encode("latin-1"), value.encode("latin-1")) for name, value in found.items()]
    await send({"type": "http.response.start", "status": refusal.status, "headers": raw})
    await send({"type": "http.response.body", "body": body})


IDLE_TIMEOUT_S: Final = 10.0
"""Seconds after which a connection on which nothing happens is closed at the latest (R8)."""
MAX_PER_ADDRESS: Final = 128
"""Connections of one address (R9)."""


class LimitedProtocol(H11Protocol):
    """HTTP/1.1 of uvicorn that closes idle connections (R8) and limits their number (R9)."""

    _look: asyncio.TimerHandle
    _before: object = None  # the latest request at the last look

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Start looking; abort a connection beyond the limit."""
        super().connection_made(transport)
        self._look = self.loop.call_later(IDLE_TIMEOUT_S / 2, self._close_if_idle)
        address = _address(self)
        if sum(_address(other) == address for other in self.connections) > MAX_PER_ADDRESS:  # R9
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop looking."""
        self._look.cancel()
        super().connection_lost(exc)

    def _close_if_idle(self) -> None:
        if self.transport.get_protocol() is not self:  # it became a socket, which has its own limits
            return
        cycle = self.cycle
        if cycle is self._before and (cycle is None or cycle.response_complete or cycle.more_body):  # R8
            self.transport.close()
            return
        self._before = self.cycle
        self._look = self.loop.call_later(IDLE_TIMEOUT_S / 2, self._close_if_idle)


def _address(connection: Any) -> str | None:
    return connection.client[0] if connection.client else None
