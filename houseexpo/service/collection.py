"""One data set on show."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan

RESERVED: Final = frozenset({"api", "static"})
"""Paths of the service itself, which no data set may take."""

_SUFFIXES: Final = (".tar.gz", ".tgz", ".zip", ".jsonl.gz", ".jsonl")


@dataclass(frozen=True)
class Collection:
    """A data set with the name under which it is shown; ``/NAME/`` is its gallery."""

    name: str
    dataset: Dataset

    @property
    def path(self) -> Path:
        """Where the data set lies."""
        return self.dataset.path

    def plan(self, plan_id: str) -> FloorPlan:
        """Return a plan by its id, which is looked up in the index; UnknownPlanError where there is none."""
        return self.dataset[plan_id]


def opened(paths: Iterable[Path]) -> dict[str, Collection]:
    """Open data sets; each is named after its folder or file, and a number follows where that name is taken.

    ConfigError where there is no path; DatasetError and PlanError as ``open_dataset`` says.
    """
    found: dict[str, Collection] = {}
    for path in paths:
        name = _free_name(_name_of(path), found)
        found[name] = Collection(name, open_dataset(path))
    if not found:
        raise ConfigError("serve: expected a data set, found none")
    return found


def _name_of(path: Path) -> str:
    """Return a name that can stand in an address: letters, digits, ``.``, ``_`` and ``-``."""
    whole = path.resolve().name
    plain = next((whole.removesuffix(suffix) for suffix in _SUFFIXES if whole.endswith(suffix)), whole)
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.") or "data"


def _free_name(name: str, taken: Iterable[str]) -> str:
    used = {*taken, *RESERVED}
    number, found = 1, name
    while found in used:
        number += 1
        found = f"{name}-{number}"
    return found
