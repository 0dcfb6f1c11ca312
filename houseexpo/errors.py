"""One small tree of exceptions; every text says which thing, what was expected, what was found, what to do."""

from __future__ import annotations

from pathlib import Path

INTERRUPTED = 130
"""The exit code of a command that Ctrl-C ended."""

NO_PLAN = 4
"""The exit code of a build of which nothing became a plan: every input was rejected."""


def installing(extra: str) -> str:
    """Return the command that installs one of the project's extras: from the clone, or from the index."""
    root = Path(__file__).resolve().parents[1]
    if (root / "pyproject.toml").is_file() and (root / "pipeline").is_dir():
        return f"in a clone of the project, pip install -e '.[{extra}]'"
    return f"pip install 'houseexpo[{extra}]'"


class HouseExpoError(Exception):
    """Root of every error that houseexpo raises on purpose."""


class PlanError(HouseExpoError):
    """A floor plan, or a file that should hold one, breaks the format.

    ``problem`` says what was expected, what was found and what to do; ``key`` is the place in the plan
    (``doors[2].rooms``); ``plan`` is the plan's id, "" where it is not known.
    """

    def __init__(self, problem: str, key: str = "", plan: str = "") -> None:
        super().__init__(problem, key, plan)  # pickles as it is made
        self.problem, self.key, self.plan = problem, key, plan

    def __str__(self) -> str:
        where = f"plan {self.plan!r}" if self.plan else "plan"
        return f"{where}: {self.key}: {self.problem}" if self.key else f"{where}: {self.problem}"

    def within(self, key: str = "", plan: str = "") -> PlanError:
        """Return the same error seen from the thing that contains it."""
        inner = self.key if not key or not self.key or self.key.startswith("[") else f".{self.key}"
        return PlanError(self.problem, key + inner, self.plan or plan)


class ConfigError(HouseExpoError):
    """A configuration, manifest or command-line value cannot be used."""


class DatasetError(HouseExpoError):
    """A data set cannot be opened, fetched or split, or holds no such thing."""


class UnknownPlanError(DatasetError, KeyError):
    """A data set has no plan of that id."""

    __str__ = Exception.__str__  # KeyError's would quote the whole sentence


class MissingDependencyError(HouseExpoError):
    """An optional library is needed for what was asked and is not installed."""


class PolicyError(HouseExpoError):
    """A policy returned what is no action, raised, died or never answered; the text names the plan and the step."""


class TrainingError(HouseExpoError):
    """Learning cannot go on: a policy is no longer one, or what is there belongs to another run."""


class WorkerError(HouseExpoError):
    """A worker process ended before it answered."""
