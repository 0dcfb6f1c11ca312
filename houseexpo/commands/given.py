"""What the commands take: a data set's path, or plans by id or file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from houseexpo.errors import ConfigError

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.floorplan import FloorPlan


def data_set(path: Path | None) -> Dataset:
    """Open the data set given, else the published one that ``houseexpo fetch`` brought, the largest of them."""
    from houseexpo.dataset import open_dataset
    from houseexpo.dataset.fetch import folder_of

    if path is not None:
        return open_dataset(path)
    for subset in ("all", "1000", "100", "10"):
        if (folder := folder_of(subset)).is_dir():
            return open_dataset(folder)
    raise ConfigError("no data set: name one with --data, or run houseexpo fetch")


def plans(names: list[str], data: Path | None) -> list[FloorPlan]:
    """Return plans by file where there is one of that name, by id of the data set else."""
    from houseexpo.dataset.plan_files import load_plan

    found, opened = [], None
    for name in names:
        if name.endswith(".json") and Path(name).is_file():
            found.append(load_plan(name))
            continue
        opened = data_set(data) if opened is None else opened
        found.append(opened[name.removesuffix(".json")])
    return found
