"""Compiling a step in a process of its own, while this one compiles what comes before it.

numba compiles one function at a time and keeps it on disk for other processes. Where that does not work, nothing is
lost: what the other process has not done is compiled when it is called first.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

from numba.core import config as config_of_numba

from houseexpo.workers import cores

Kernel: TypeAlias = Callable[..., None]
"""One that makes the steps of environments."""

_MAX_WAIT_S = 120.0  # that anybody waits for the other process
_MARK = "HOUSEEXPO_COMPILES"  # in the environment of the other process: whatever it is, it starts no further ones
_running: dict[Kernel, subprocess.Popen[bytes]] = {}


def precompile(kernel: Any) -> None:
    """Begin, where that saves time: the kernel is not on disk yet, and there is a core for it.

    Processes that multiprocessing has started do not: each would start another, for the same kernel.
    """
    if config_of_numba.DISABLE_JIT or kernel in _running or kernel.signatures or _is_kept(kernel):  # type: ignore[attr-defined]
        return
    is_python = sys.executable and not getattr(sys, "frozen", False)
    if cores() < 2 or not is_python or _MARK in os.environ or multiprocessing.parent_process() is not None:
        return
    command = [sys.executable, "-m", "houseexpo.pseudoslam.precompile_worker", kernel.__name__]
    try:
        paths = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        _running[kernel] = subprocess.Popen(  # noqa: S603  # this interpreter, and a name of ours
            command,
            env={**os.environ, "PYTHONPATH": paths, "PYTHONSAFEPATH": "1", _MARK: "1"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:  # no more processes are allowed, or the folder is gone: it is compiled here
        return


def wait_for(kernel: Kernel) -> None:
    """Wait until the other process is done with a kernel, if one is at it; what it has not done is done here."""
    process = _running.get(kernel) if _running else None
    if process is None:
        return
    try:
        process.wait(_MAX_WAIT_S)
    except subprocess.TimeoutExpired:
        _end(process)
    _running.pop(kernel, None)


def _is_kept(kernel: Any) -> bool:
    """Whether a kernel has been compiled to disk before, by such a Python.

    What other sources were compiled to counts too: after a change of kernels they are compiled where they are called.
    """
    place, file = Path(kernel.stats.cache_path), Path(kernel.py_func.__code__.co_filename).stem
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    return any(place.glob(f"{file}.{kernel.__name__}-*.{python}*.nbi"))


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


@atexit.register
def _end_all() -> None:
    """End what nobody waited for."""
    while _running:
        _end(_running.popitem()[1])
