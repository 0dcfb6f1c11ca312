"""Compiling a step's kernel in a process of its own, while this one compiles what an episode's start takes.

numba compiles one function at a time, and keeps it on disk for other processes: two processes have a first step ready
in three quarters of the time of one. Where there cannot be another, each kernel is compiled when it is called first.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import houseexpo
from houseexpo.kernel_cache import is_missing
from houseexpo.pseudoslam.kernels.compiling import compiled_elsewhere, say_once
from houseexpo.workers import cores

_MOST_S: Final = 120.0  # that anybody waits for the other process
_NOWHERE: Final = subprocess.DEVNULL
_running: dict[Any, subprocess.Popen[bytes]] = {}


def compile_ahead(kernel: Any) -> None:
    """Begin, where the kernel is not on disk yet, and there is a core for it.

    Workers of a pool do not: each of them would start another, for the same kernel.
    """
    if not hasattr(kernel, "signatures") or kernel.signatures or kernel in _running:  # numba is off, or it is there
        return
    if cores() > 1 and multiprocessing.parent_process() is None and sys.executable and is_missing(kernel):
        paths = str(Path(houseexpo.__file__).parents[1]), *filter(None, sys.path)
        command = [sys.executable, "-P", "-m", "houseexpo.pseudoslam.compile_step", kernel.__name__]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"}
        with suppress(OSError):  # no more processes are allowed: it is compiled here
            _running[kernel] = subprocess.Popen(  # noqa: S603  # this interpreter, and a name of ours
                command, env=environment, stdin=_NOWHERE, stdout=_NOWHERE, stderr=_NOWHERE
            )


def wait_for(kernel: Any) -> None:
    """Wait until the other process is done with a kernel, where one is at it; what it leaves undone is done here."""
    process = _running.pop(kernel, None) if _running else None
    if process is None:
        return
    if process.poll() is None:
        say_once()
    try:
        with compiled_elsewhere():
            process.wait(_MOST_S)
    except subprocess.TimeoutExpired:
        _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


@atexit.register
def _end_all() -> None:
    """End what nobody has waited for."""
    while _running:
        _end(_running.popitem()[1])
