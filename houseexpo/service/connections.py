"""Connections that are held open for nothing are closed: uvicorn bounds the time after an answer, and no other.

R1  A connection on which no request was begun since the last look, and none is being answered, is closed; one looks
    every ``IDLE_TIMEOUT_S``. A head of which only a part has come is no request. Neither is a request whose body is not
    whole at the second look: bodies are small here, and one that never comes would hold a worker's place.
R2  An address has a number of connections. Together with R1 no client without the token takes all descriptors.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

IDLE_TIMEOUT_S: Final = 10.0
MAX_PER_ADDRESS: Final = 128


class LimitedProtocol(H11Protocol):
    """HTTP/1.1 as uvicorn speaks it, with a client that goes on asking."""

    _look: asyncio.TimerHandle
    _before: object = None  # the request that was the latest at the last look

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn has it
        """Begin to look; a connection too many is cut off."""
        super().connection_made(transport)
        self._look = self.loop.call_later(IDLE_TIMEOUT_S, self._looked)
        address = _address(self)
        if sum(_address(other) == address for other in self.connections) > MAX_PER_ADDRESS:  # R2
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End to look."""
        self._look.cancel()
        super().connection_lost(exc)

    def _looked(self) -> None:
        if self.transport.get_protocol() is not self:  # it became a socket, which has limits of its own
            return
        cycle = self.cycle
        if cycle is self._before and (cycle is None or cycle.response_complete or cycle.more_body):  # R1
            self.transport.close()
            return
        self._before = self.cycle
        self._look = self.loop.call_later(IDLE_TIMEOUT_S, self._looked)


def _address(connection: Any) -> str | None:
    return connection.client[0] if connection.client else None
