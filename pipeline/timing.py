"""Measure how long each stage takes, for the report of a build."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from pipeline.rejection import Rejection

Value = TypeVar("Value")

_seconds: ContextVar[dict[str, float] | None] = ContextVar("seconds by stage", default=None)


@contextmanager
def collect_times() -> Iterator[dict[str, float]]:
    """Collect the seconds of each stage that runs meanwhile, by its name."""
    seconds: dict[str, float] = {}
    token = _seconds.set(seconds)
    try:
        yield seconds
    finally:
        _seconds.reset(token)


def time_stages(values: Iterable[Value], stage_of: Callable[[Value], str]) -> Iterator[Value]:
    """Yield the values; the time that each one took to come is its stage's, that of a rejection the rejecting one's."""
    seconds, iterator = _seconds.get(), iter(values)
    while True:
        start = time.perf_counter()
        try:
            value = next(iterator)
        except StopIteration:
            return
        except Rejection as rejection:
            _add(seconds, rejection.stage, start)
            raise
        _add(seconds, stage_of(value), start)
        yield value


def _add(seconds: dict[str, float] | None, stage: str, start: float) -> None:
    if seconds is not None:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
