"""Computing that takes long, a few at a time, so that pages answer meanwhile.

R1  Two computations run at once; others wait for their turn.
R2  Where many wait already, another one is sent away (503).
R3  What nobody waits for any more when its turn comes, since the browser asked for something else, is left out.
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
_LATER: Final = {"retry-after": "5"}


async def computed(request: Request, function: Callable[..., T], *args: Any) -> T:
    """Call a function in a thread when it is its turn; HTTPException (503) where it is not called."""
    turns = _turns()
    if turns.taken >= _AT_ONCE + MAX_WAITING:  # R2
        raise HTTPException(503, "Much is being computed just now; ask again in some seconds.", _LATER)
    turns.taken += 1
    try:
        async with turns.limiter:  # R1
            if await request.is_disconnected():  # R3
                raise HTTPException(503, "Nobody waits for this any more.")
            return await anyio.to_thread.run_sync(partial(function, *args), limiter=CapacityLimiter(1))
    finally:
        turns.taken -= 1


@asynccontextmanager
async def few_threads(_: Any) -> AsyncIterator[None]:
    """Let few threads answer while the service runs: more of them only take the interpreter from each other."""
    limiter = anyio.to_thread.current_default_thread_limiter()
    before, limiter.total_tokens = limiter.total_tokens, _ANSWERING
    yield
    limiter.total_tokens = before


@dataclass
class _Turns:
    """``taken``: how many computations run or wait."""

    limiter: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(_AT_ONCE))
    taken: int = 0


@cache
def _turns() -> _Turns:
    return _Turns()
