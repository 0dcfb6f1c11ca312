"""Define the exceptions that houseexpo raises on purpose, and exit codes of its commands.

Each message names the object, what was expected, what was found and what to do.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from pathlib import Path

ANSWER_IS_NO = 1
"""The exit code of a command that did its work: a file is damaged, a house gives no plan, no other fit is better."""

INTERRUPTED = 130
"""The exit code of a command that was interrupted with Ctrl-C."""

NOT_DONE = 3
"""The exit code of a command that a transient fault, such as a full disk, kept from doing all of its work."""

NO_PLAN = 4
"""The exit code of a build that produced no plan because every input was rejected."""


def install_command(extra: str) -> str:
    """Return the command that installs an extra of this project, from the clone or from the package index."""
    root = Path(__file__).resolve().parents[1]
    if (root / "pyproject.toml").is_file() and (root / "pipeline").is_dir():
        return f"in a clone of the project, pip install -e '.[{extra}]'"
    return f"pip install 'houseexpo[{extra}]'"


class HouseExpoError(Exception):
    """Base class of all errors that houseexpo raises on purpose."""


class PlanError(HouseExpoError):
    """A floor plan, or a file that should contain one, violates the format.

    ``problem`` says what was expected, what was found and what to do. ``key`` is the position in the plan
    (``doors[2].rooms``). ``plan`` is the plan's id, or "" if it is unknown.
    """

    def __init__(self, problem: str, key: str = "", plan: str = "") -> None:
        super().__init__(problem, key, plan)  # the same arguments, so that it can be unpickled
        self.problem, self.key, self.plan = problem, key, plan

    def __str__(self) -> str:
        where = f"plan {self.plan!r}" if self.plan else "plan"
        return f"{where}: {self.key}: {self.problem}" if self.key else f"{where}: {self.problem}"

    def within(self, key: str = "", plan: str = "") -> PlanError:
        """Return the error with ``key`` put before its own key, and with ``plan`` as its plan unless it has one."""
        inner = self.key if not key or not self.key or self.key.startswith("[") else f".{self.key}"
        return PlanError(self.problem, key + inner, self.plan or plan)


class ConfigError(HouseExpoError):
    """A configuration, manifest or command-line value cannot be used."""


class DatasetError(HouseExpoError):
    """A data set cannot be opened, fetched or split, or lacks a requested item."""


class UnknownPlanError(DatasetError, KeyError):
    """A data set has no plan with the given id."""

    __str__ = Exception.__str__  # KeyError.__str__ would put the message in quotes


class MissingDependencyError(HouseExpoError):
    """An optional library that the requested operation needs is not installed."""


class PolicyError(HouseExpoError):
    """A policy returned an invalid action, raised, died or did not answer. The message names the plan and the step."""


class TrainingError(HouseExpoError):
    """Training cannot start or continue: it diverged, a file is unusable, or a folder belongs to another run."""


class WorkerError(HouseExpoError):
    """A worker process ended before it returned a result."""


# Transient faults, such as a full disk: they say nothing about the input that was being processed.

_TRANSIENT = frozenset(
    {
        errno.EAGAIN,
        errno.EBUSY,
        errno.EDQUOT,
        errno.EIO,
        errno.EMFILE,
        errno.ENFILE,
        errno.ENOMEM,
        errno.ENOSPC,
        errno.EROFS,
        errno.ESTALE,
        errno.ETIMEDOUT,
    }
)
_NO_SCRATCH = "No usable temporary directory"  # Python's message if it can write to no temporary folder


def find_transient_fault(error: BaseException) -> OSError | None:
    """Return the transient fault that caused an error, or None if its cause is not transient."""
    for cause in _causes(error):
        if isinstance(cause, OSError) and (cause.errno in _TRANSIENT or _NO_SCRATCH in str(cause)):
            return cause
    return None


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
