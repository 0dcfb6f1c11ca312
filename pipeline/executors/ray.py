"""Map a function over items on a Ray cluster, with the limits of ``local``; yield each item's result or Failure.

Rules:

1. A task is a few items. On its node it is done as ``local`` does it, by one worker process of its own, so that limits
   and crashes cost what they cost there: one item, not the task.
2. A task that ends with its node, or with the process that Ray gave it, is done again elsewhere, as often as it takes
   up to a limit; then its items are failures that say so.
3. As many tasks are handed out as keep every core of the cluster busy, those of nodes that come later too.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import chdir
from itertools import islice
from pathlib import Path
from typing import Any

import houseexpo
from houseexpo.errors import HouseExpoError, MissingDependencyError, install_command
from houseexpo.processes import child_environment
from pipeline.executors import local
from pipeline.executors.local import Failure, Item, Limits, Result

_ITEMS = 8
_AHEAD = 2  # tasks that wait for each core
_NODE_TRIES = 10
_WAIT_S, _KNOCK_S = 1.0, 10.0


def run(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    address: str | None,
    limits: Limits,
    preload: Sequence[str] = (),
) -> Iterator[tuple[Item, Result | Failure]]:
    """Yield each item with its result or its failure, as tasks end.

    Parameters
    ----------
    address
        The cluster's, as Ray has it: ``ray://head:10001``, ``head:6379``, ``auto``; None is what RAY_ADDRESS says, or a
        cluster of this machine that lives as long as this run.

    Raises
    ------
    HouseExpoError
        Where the cluster cannot be reached.
    """
    ray = _connect(address)
    try:
        yield from _run(ray, (function, limits, tuple(preload)), iter(items))
    except (ConnectionError, ray.exceptions.RayError) as error:
        place, kind = address or "of this machine", type(error).__name__
        raise HouseExpoError(
            f"the Ray cluster {place} is gone ({kind}); what is done is kept: run this command again when it is back"
        ) from None
    finally:
        ray.shutdown()


def _run(ray: Any, work: tuple[Any, ...], items: Iterator[Item]) -> Iterator[tuple[Item, Any]]:
    shared = ray.put(work)
    remote = ray.remote(num_cpus=1, max_retries=_NODE_TRIES)(_task)  # R2
    given: dict[Any, list[Item]] = {}
    while True:
        most = _AHEAD * max(int(ray.cluster_resources().get("CPU", 1)), 1)  # R3
        while len(given) < most and (task := list(islice(items, _ITEMS))):
            given[remote.remote(shared, task)] = task
        if not given:
            return
        ended, _ = ray.wait(list(given), timeout=_WAIT_S)
        for reference in ended:
            yield from _results(ray, reference, given.pop(reference))


def _results(ray: Any, reference: Any, task: list[Item]) -> list[tuple[Item, Any]]:
    try:
        return list(zip(task, ray.get(reference), strict=True))
    except ray.exceptions.RayTaskError as error:
        raise HouseExpoError(f"a node of the Ray cluster cannot do the work: {error.cause or error}") from None
    except ray.exceptions.RayError as error:
        lost = Failure("killed", f"its nodes were lost {_NODE_TRIES} times ({type(error).__name__})")
        return [(item, lost) for item in task]


def _task(work: tuple[Any, ...], task: list[Any]) -> list[Any]:
    """Run a task on its node (R1); return results in the order of the items."""
    function, limits, preload = work
    places = {id(item): place for place, item in enumerate(task)}
    results: list[Any] = [None] * len(task)
    for item, result in local.run(function, task, workers=1, limits=limits, preload=preload):
        results[places[id(item)]] = result
    return results


def _connect(address: str | None) -> Any:
    try:
        import ray
    except ImportError:
        raise MissingDependencyError(f"--executor ray needs Ray: {install_command('ray')}") from None
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is told to anybody
    try:
        _check_listening(address or os.environ.get("RAY_ADDRESS", ""))
        shown = False if address is None else None
        # Ray puts the working directory first on its workers' import path, where any file of it would be run
        with child_environment(), chdir(Path(houseexpo.__file__).parents[1]):
            ray.init(address=address, log_to_driver=False, logging_level=logging.WARNING, include_dashboard=shown)
    except (OSError, ValueError, RuntimeError) as error:
        raise HouseExpoError(f"Ray cluster {address or ''}: cannot be reached ({error}); check --address") from None
    return ray


def _check_listening(address: str) -> None:
    """Raise OSError if nobody listens: Ray itself would try for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():
        socket.create_connection((host, int(port)), _KNOCK_S).close()
