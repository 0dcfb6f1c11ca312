"""Run a policy in its own process (no sandbox): it gets observations, returns actions, and has no environment or plan.

R1  The process is started anew, with none of the caller's objects, with the pipe as its only open file beside the
    streams, and with the environment variables of ``KEPT`` only.
R2  It gets the robot at the start of an episode, and an observation and the robot's knowledge in each step. Large
    arrays go through memory that both processes share, and are copied there.
R3  Its answers are JSON of at most ``LONGEST_ANSWER`` bytes: nothing that it sends is executed.
R4  It ends with the process that started it.
R5  It says when it compiles kernels, so that this does not count as time of the policy, up to ``COMPILING_S``.
R6  A predicted map, where the benchmark asks for one, comes back through the same memory, with its shape as JSON.
R7  An answer that takes longer than the limit ends the process; in the benchmark, ``supervise`` times the steps.

A policy can still read and write files as the user who runs the benchmark, and use the network. The benchmark keeps
honest policies from an accident and makes cheating deliberate; for strangers' code, use a container.
"""

from __future__ import annotations

import json
import math
import mmap
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Final, NamedTuple

import numpy as np

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.pseudoslam import kernels
from houseexpo.pseudoslam.agents.loading import NamedPolicy, describe_exception, describe_no_policy, load_policy
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Robot, Training
from houseexpo.pseudoslam.benchmark.prediction import Grid, check_predicted_map
from houseexpo.pseudoslam.config import ObservationConfig
from houseexpo.pseudoslam.kernels.compiling import call_around_compiling

KEPT: Final = (
    *("PATH", "HOME", "LANG", "LC_", "TMPDIR", "PYTHONPATH", "PYTHONHASHSEED", "VIRTUAL_ENV", "LD_LIBRARY_PATH"),
    *("NUMBA_", "OMP_", "OPENBLAS_", "MKL_", "CUDA_", "XDG_CACHE_HOME"),
)
"""The beginnings of the names of environment variables that a policy's process gets."""
DECISION_LIMIT_S: Final = 60.0
"""Time limit of an action, if no other one is given: planners in large houses need some seconds."""
LONGEST_ANSWER: Final = 1 << 20
COMPILING_S: Final = 900.0
SHARED_BYTES: Final = 1 << 26
SMALL_BYTES: Final = 1 << 12
"""Smaller arrays go through the pipe."""
_CODE: Final = (
    "import sys; from houseexpo.pseudoslam.benchmark.policy_process import serve_policy; "
    "serve_policy(*map(int, sys.argv[1:]))"
)
_POLICY_LOOK_S: Final = 1.0
_UNREADABLE: Final = "its process sent an answer that cannot be read"


class PolicyProcessError(HouseExpoError):
    """A policy raised an exception, or its process ended; the text says which, without the place."""


class PolicyProcess:
    """A policy's process. Close it, or use it in a ``with`` statement.

    Parameters
    ----------
    name
        A name for ``load_policy``.
    limit_s
        Time limit of an answer in seconds, without compiling; None for no limit (R7).

    Raises
    ------
    ConfigError
        As ``load_policy`` does.
    PolicyProcessError
        The process ended while the policy was loaded.
    """

    def __init__(self, name: str, limit_s: float | None = DECISION_LIMIT_S) -> None:
        self._limit_s = limit_s
        ours, its = socket.socketpair()
        self._shared, descriptor = _new_shared()
        with its:
            self._process = subprocess.Popen(  # noqa: S603  # our own interpreter
                [sys.executable, "-P", "-c", _CODE, str(its.fileno()), str(descriptor)],
                env={key: value for key, value in os.environ.items() if key.startswith(KEPT)},
                stdin=subprocess.DEVNULL,
                pass_fds=(its.fileno(), descriptor),
            )
        os.close(descriptor)
        self._pipe = Connection(ours.detach())
        self._stop_clock: Callable[[], None] = lambda: None
        self._start_clock: Callable[[], None] = lambda: None
        self._busy_since: float | None = None
        self._compiling_s = COMPILING_S
        try:
            self._pipe.send((name, sys.path))
            self.policy = self._read_policy()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> PolicyProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._pipe.close()
        self._shared.close()

    def time_with(self, stop_clock: Callable[[], None], start_clock: Callable[[], None]) -> None:
        """Have functions called when the policy's process begins and ends to compile kernels (R5)."""
        self._stop_clock, self._start_clock = stop_clock, start_clock

    def ask(self, *question: Any) -> dict[str, Any]:
        """Send a question, and return the answer; raise PolicyProcessError if the policy failed."""
        with suppress(OSError):  # it has died, which is noticed when its answer is read
            self._pipe.send(_share_arrays(question, self._shared))
        said = self._answer(self._limit_s)
        if "failed" in said:
            raise PolicyProcessError(str(said["failed"]))
        return said

    def predicted_map(self, info: Knowledge) -> Grid:
        """Return the map (rows, cols) that the policy predicts; raise PolicyProcessError if it predicts no map (R6)."""
        shape = self.ask("predict", info).get("shape")
        if shape != list(info["map"].shape):
            raise PolicyProcessError(f"predicted_map: expected an array of shape {info['map'].shape}, found {shape}")
        rows, cols = info["map"].shape
        return np.frombuffer(self._shared, np.uint8, rows * cols).reshape(rows, cols).copy()

    def _read_policy(self) -> NamedPolicy:
        said = self._answer()
        if "refused" in said:
            raise ConfigError(str(said["refused"]))
        try:
            return _policy_of(said, self)
        except (LookupError, TypeError, ValueError):  # a policy's module may send anything
            raise PolicyProcessError(_UNREADABLE) from None

    def _answer(self, limit_s: float | None = None) -> dict[str, Any]:
        asked, compiling_s = time.monotonic(), self._compiling_s
        while True:
            try:
                if self._busy_since is not None:
                    left_s = self._busy_since + self._compiling_s - time.monotonic()
                    if left_s <= 0.0 or not self._pipe.poll(left_s):
                        self._compiles(busy=False)
                if self._busy_since is None and limit_s is not None:
                    spent_s = time.monotonic() - asked - (compiling_s - self._compiling_s)
                    if not self._pipe.poll(max(limit_s - spent_s, 0.0)):
                        self._process.kill()  # R7: a late answer would be taken for the answer to the next question
                        raise PolicyProcessError(f"expected an answer within {limit_s:g} s, found none")
                data = self._pipe.recv_bytes(LONGEST_ANSWER)
            except (EOFError, OSError):
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(_POLICY_LOOK_S)
                code = self._process.returncode
                raise PolicyProcessError(
                    "its process closed its connection" if code is None else f"its process died, exit code {code}"
                ) from None
            try:
                said = json.loads(data)
            except (ValueError, RecursionError):
                said = None
            if not isinstance(said, dict):
                raise PolicyProcessError(_UNREADABLE)
            if "compiling" not in said:
                return said
            self._compiles(busy=bool(said["compiling"]))

    def _compiles(self, *, busy: bool) -> None:
        """R5: stop the clock while the policy's process compiles, and let it go on."""
        now = time.monotonic()
        if busy and self._busy_since is None and self._compiling_s > 0.0:
            self._busy_since = now
            self._stop_clock()
        elif not busy and self._busy_since is not None:
            self._compiling_s -= now - self._busy_since
            self._busy_since = None
            self._start_clock()


class _Factory:
    """The factory of a policy that is in another process."""

    def __init__(self, process: PolicyProcess, interface: Interface, training: Training | None) -> None:
        self._process, self.interface, self.training = process, interface, training

    def __call__(self, robot: Robot, seed: int) -> _Policy:
        self._process.ask("new", robot, seed)
        return _Policy(self._process)


class _Policy:
    """A policy that is in another process."""

    def __init__(self, process: PolicyProcess) -> None:
        self._process = process
        self.decided = True

    def __call__(self, observation: Any, info: Knowledge) -> Any:
        said = self._process.ask("act", observation, info)
        self.decided = bool(said.get("decided", True))
        action = said.get("action")
        return np.array(action) if isinstance(action, list) else action

    def predicted_map(self, info: Knowledge) -> Grid:
        """Return the policy's prediction; raise PolicyProcessError if there is no prediction, or it is not a map."""
        return self._process.predicted_map(info)


def _policy_of(said: dict[str, Any], process: PolicyProcess) -> NamedPolicy:
    """Return the policy that a process describes."""
    shown, made = said["interface"], said["training"]
    view = None if shown["view"] is None else ObservationConfig(**shown["view"])
    interface = Interface(
        shown["actions"],
        shown["observation"],
        view,
        bool(shown["sees_truth"]),
        tuple(map(str, shown["tasks"])),
        bool(shown["action_mask"]),
    )
    training = None if made is None else Training(str(made["family"]), int(made["seed"]))
    return NamedPolicy(str(said["name"]), _Factory(process, interface, training), str(said["source"]), said["sha256"])


# ---------------------------------------------------------------------------------------------------------------------
# Arrays in shared memory (R2).
# ---------------------------------------------------------------------------------------------------------------------


class _Place(NamedTuple):
    """An array in shared memory."""

    dtype: str
    shape: tuple[int, ...]
    start: int


def _new_shared() -> tuple[mmap.mmap, int]:
    """Return shared memory, which takes no space before it is written, and the descriptor of its file."""
    if sys.platform == "linux":
        descriptor = os.memfd_create("houseexpo")
    else:
        with tempfile.TemporaryFile() as file:
            descriptor = os.dup(file.fileno())
    os.ftruncate(descriptor, SHARED_BYTES)
    return mmap.mmap(descriptor, SHARED_BYTES), descriptor


def _share_arrays(value: Any, memory: mmap.mmap) -> Any:
    """Return a question with its large arrays in shared memory, as many as fit."""
    end = 0

    def share(part: Any) -> Any:
        nonlocal end
        if isinstance(part, dict):
            return {key: share(each) for key, each in part.items()}
        if type(part) is tuple:
            return tuple(map(share, part))
        if not isinstance(part, np.ndarray) or part.dtype.hasobject:
            return part
        if part.nbytes < SMALL_BYTES or end + part.nbytes > SHARED_BYTES:
            return part
        start, end = end, end + part.nbytes
        np.frombuffer(memory, part.dtype, part.size, start)[:] = part.ravel()
        end += -end % 64
        return _Place(part.dtype.str, part.shape, start)

    return share(value)


def _copy_shared(value: Any, memory: mmap.mmap) -> Any:
    if isinstance(value, _Place):
        found = np.frombuffer(memory, value.dtype, math.prod(value.shape), value.start)
        return found.reshape(value.shape).copy()
    if isinstance(value, dict):
        return {key: _copy_shared(each, memory) for key, each in value.items()}
    return tuple(_copy_shared(each, memory) for each in value) if type(value) is tuple else value


# ---------------------------------------------------------------------------------------------------------------------
# The policy's side.
# ---------------------------------------------------------------------------------------------------------------------


def serve_policy(descriptor: int, memory: int) -> None:
    """Answer the questions that arrive until the other end of the pipe is closed; large arrays lie in the memory."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the first process handles Ctrl-C
    _end_with_parent()
    pipe, shared = Connection(descriptor), mmap.mmap(memory, SHARED_BYTES)
    call_around_compiling(kernels.__name__, lambda: _say(pipe, compiling=True), lambda: _say(pipe, compiling=False))
    with suppress(EOFError, OSError):
        name, path = pipe.recv()
        sys.path += [place for place in path if place and place not in sys.path]
        try:
            named = load_policy(name)
        except HouseExpoError as error:
            _say(pipe, refused=str(error))
            return
        _say(pipe, **_describe(named))
        policy: Any = None
        while True:
            kind, *question = _copy_shared(pipe.recv(), shared)
            try:
                if kind == "new":
                    policy = named.factory(*question)
                    if not callable(policy):
                        _say(pipe, failed=describe_no_policy(named, policy))
                        continue
                    _say(pipe)
                    continue
                if kind == "predict":
                    _say(pipe, **_prediction(policy, question[0], shared))
                    continue
                action = policy(*question)
            except (Exception, SystemExit) as error:  # noqa: BLE001  # whatever a policy raises is told
                _say(pipe, failed=f"it raised {describe_exception(error, __file__)}")
                continue
            _say(pipe, action=_plain(action), decided=bool(getattr(policy, "decided", True)))


def _prediction(policy: Any, info: Knowledge, memory: mmap.mmap) -> dict[str, Any]:
    """Write a policy's predicted map to the shared memory, and return the answer (R6)."""
    predict = getattr(policy, "predicted_map", None)
    if predict is None:
        return {"failed": "expected a method predicted_map(info), found none; choose another --prediction"}
    shape = info["map"].shape
    found = check_predicted_map(predict(info), shape)
    if found.size > SHARED_BYTES:
        return {"failed": f"predicted_map: a map of {found.size:,} cells is too large to be passed on"}
    np.frombuffer(memory, np.uint8, found.size)[:] = found.ravel()
    return {"shape": shape}


def _describe(named: NamedPolicy) -> dict[str, Any]:
    shown, made = named.interface, named.training
    view = None if shown.view is None else vars(shown.view)
    return {
        "name": named.name,
        "source": named.source,
        "sha256": named.sha256,
        "interface": {
            "actions": shown.actions,
            "observation": shown.observation,
            "view": view,
            "sees_truth": shown.sees_truth,
            "tasks": list(shown.tasks),
            "action_mask": shown.action_mask,
        },
        "training": None if made is None else {"family": made.family, "seed": made.seed},
    }


def _say(pipe: Connection, **said: Any) -> None:
    pipe.send_bytes(json.dumps(said, default=repr).encode())


def _plain(action: Any) -> Any:
    """Return an action as JSON has it; what is no number and no array goes as the text that Python shows."""
    if isinstance(action, np.generic | np.ndarray):
        return action.tolist()
    if isinstance(action, list | tuple):
        return [_plain(each) for each in action]
    return action


def _end_with_parent() -> None:
    """R4: also in the middle of an endless loop, and where the parent is killed."""
    parent = os.getppid()
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(0)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_POLICY_LOOK_S)
        os._exit(0)

    threading.Thread(target=watch, daemon=True).start()
