"""Run long computations for requests in threads, two at a time, so that other pages answer in the meantime.

R1  Two computations run at once; others wait for their turn.
R2  If too many are waiting, another one is refused (503).
R3  A computation is skipped if the browser has gone when its turn comes.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, Final, TypeVar

import anyio.to_thread
from anyio import CapacityLimiter
from starlette.exceptions import HTTPException
from starlette.requests import Request

T = TypeVar("T")

MAX_WAITING: Final = 32

_AT_ONCE: Final = 2
_ANSWERING: Final = 4
"""Threads that answer requests; more would only compete for the interpreter."""
_LATER: Final = {"retry-after": "5"}


async def compute_in_turn(request: Request, function: Callable[..., T], *args: Any) -> T:
    """Call a function in a thread when it is its turn; raise HTTPException (503) if it is not called (R2, R3)."""
    turns = _turns()
    if turns.taken >= _AT_ONCE + MAX_WAITING:  # R2
        raise HTTPException(503, "The server is busy; try again in a few seconds.", _LATER)
    turns.taken += 1
    try:
        async with turns.limiter:  # R1
            if await request.is_disconnected():  # R3
                raise HTTPException(503, "The client has gone.")
            return await anyio.to_thread.run_sync(partial(function, *args), limiter=CapacityLimiter(1))
    finally:
        turns.taken -= 1


@asynccontextmanager
async def limit_threads(_: Any) -> AsyncIterator[None]:
    """Limit the threads that answer requests while the service runs."""
    limiter = anyio.to_thread.current_default_thread_limiter()
    before, limiter.total_tokens = limiter.total_tokens, _ANSWERING
    yield
    limiter.total_tokens = before


@dataclass
class _Turns:
    """``taken`` is the number of computations that run or wait."""

    limiter: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(_AT_ONCE))
    taken: int = 0


@cache
def _turns() -> _Turns:
    return _Turns()
