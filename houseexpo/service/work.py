"""Computing that takes long, a few at a time, so that pages answer meanwhile."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import cache, partial
from typing import Any, Final, TypeVar

import anyio.to_thread
from anyio import CapacityLimiter

T = TypeVar("T")

_AT_ONCE: Final = 2
_ANSWERING: Final = 4


async def computed(function: Callable[..., T], *args: Any, **options: Any) -> T:
    """Call a function in a thread; two such calls run at once, others wait for their turn."""
    return await anyio.to_thread.run_sync(partial(function, *args, **options), limiter=_turns())


@asynccontextmanager
async def few_threads(_: Any) -> AsyncIterator[None]:
    """Let few threads answer while the service runs: more of them only take the interpreter from each other."""
    limiter = anyio.to_thread.current_default_thread_limiter()
    before, limiter.total_tokens = limiter.total_tokens, _ANSWERING
    yield
    limiter.total_tokens = before


@cache
def _turns() -> CapacityLimiter:
    return CapacityLimiter(_AT_ONCE)
