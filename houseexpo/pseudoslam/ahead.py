"""Compile the kernel of a step in another process, while this one compiles the kernels of an episode's start.

numba compiles one function at a time and caches it on disk for other processes. With two processes, the first step is
ready in three quarters of the time. If a second process is not possible, each kernel is compiled when it is first
called.
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

_MOST_S: Final = 120.0  # longest wait for the other process
_NOWHERE: Final = subprocess.DEVNULL
_running: dict[Any, subprocess.Popen[bytes]] = {}


def compile_ahead(kernel: Any) -> None:
    """Start to compile the kernel if it is not on disk yet and there is a free core.

    Workers of a pool do not, since each of them would start a process for the same kernel.
    """
    if not hasattr(kernel, "signatures") or kernel.signatures or kernel in _running:  # no numba, or compiled
        return
    if cores() > 1 and multiprocessing.parent_process() is None and sys.executable and is_missing(kernel):
        paths = str(Path(houseexpo.__file__).parents[1]), *filter(None, sys.path)
        command = [sys.executable, "-P", "-m", "houseexpo.pseudoslam.compile_step", kernel.__name__]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"}
        with suppress(OSError):  # no more processes are allowed: compile it here
            _running[kernel] = subprocess.Popen(  # noqa: S603  # this interpreter, and a name of ours
                command, env=environment, stdin=_NOWHERE, stdout=_NOWHERE, stderr=_NOWHERE
            )


def wait_for(kernel: Any) -> None:
    """Wait until the other process has compiled a kernel, if it is compiling it; if it fails, it is compiled here."""
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
    """End processes that nobody has waited for."""
    while _running:
        _end(_running.popitem()[1])
