"""Build a data set from Python, as ``houseexpo build`` does on the command line."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final, Literal

from houseexpo.dataset.dataset import Dataset, open_dataset
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.files import named_path

GROUP: Final = "houseexpo.builders"
"""The group of entry points that build data sets; the pipeline provides one."""

Place = str | os.PathLike[str]


def build(
    source: Place | Iterable[Place],
    out: Place,
    *,
    config: Place | None = None,
    overrides: Place | None = None,
    workers: int | None = None,
    seconds: float | None = None,
    memory: float | None = None,
    limit: int | None = None,
    seed: int | None = None,
    up: Literal["auto", "y", "z"] | None = None,
    units: str | None = None,
    scale: float | None = None,
    storey_height: float | None = None,
    resolution: float | None = None,
    furniture: bool | None = None,
    model_path: str | None = None,
    weights: Place | None = None,
    min_quality: float | None = None,
    keep_stages: bool | None = None,
    keep_copies: bool | None = None,
    others: Literal["refuse", "add", "replace"] = "refuse",
) -> Dataset:
    """Build a data set of floor plans from 3D houses, and open it.

    An interrupted build continues where it stopped. The same houses and options give the same bytes for any number of
    workers. The data set's ``rejected`` lists the houses that gave no plan, with the reason.

    Parameters
    ----------
    source
        A mesh, an IFC file, a folder of such files, a SUNCG root, ``"procedural:20"`` for 20 generated homes, or
        several of these; ``()`` if ``config`` names the sources.
    out
        The folder of the data set. It is created if it does not exist.
    config
        A manifest: a TOML file with sources and parameters, or the name of one that comes with houseexpo ("demo").
    overrides
        A TOML file with manual corrections.
    workers
        Number of processes; by default one for each core.
    seconds, memory
        The limits of one house, 300 s of processor time and 4 GiB by default; a house that exceeds one is rejected.
    limit
        Take only this many houses, the first ones.
    seed
        The seed of all random numbers; 0 by default.
    up, units, scale, storey_height
        For mesh files: the up axis, the unit ("mm", "ft", or metres per unit), the scale (20 for a model at 1:20) and
        the height of a storey in metres. Those that are not given are determined from the file.
    resolution
        The side of a cell, metres, of robots' maps that do not say it: pictures and arrays without a ``map.yaml``.
    furniture
        Whether furniture counts as an obstacle.
    model_path
        Folders with Gazebo models, separated as in PATH.
    weights
        A file of weights that ``houseexpo fit`` wrote from labels of reviewed houses, for houses of the same kind.
    min_quality
        Reject plans with a lower quality score, 0 to 1.
    keep_stages
        Whether to save a picture of the stages beside each plan.
    keep_copies
        Whether to keep plans with the same walls, rooms and doors as others. By default, the first one by id stands for
        them all, and its row of the index names them (``copies``).
    others
        What to do if ``out`` holds plans from other sources: "refuse" to build, "add" the new plans to them, or
        "replace" them.

    Returns
    -------
    The data set; empty if no house gave a plan.

    Raises
    ------
    ConfigError
        A source does not exist, an option has an invalid value, or ``out`` holds something else.

    Examples
    --------
    >>> import tempfile
    >>> plans = build("procedural:1", tempfile.mkdtemp(), workers=1)
    >>> len(plans), plans.rejected
    (1, [])
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not found:
        raise MissingDependencyError("houseexpo.build: no pipeline is installed; reinstall houseexpo")
    if others not in {"refuse", "add", "replace"}:
        raise ConfigError(f"others: expected 'refuse', 'add' or 'replace', found {others!r}")
    sources = [source] if isinstance(source, (str, os.PathLike)) else list(source)
    for each in (*sources, out):
        named_path(each, "build")
    run = next(iter(found.values())).load()
    run(
        [os.fspath(each) for each in sources],
        os.fspath(out),
        config=None if config is None else Path(config),
        overrides=None if overrides is None else Path(overrides),
        workers=workers,
        seconds=seconds,
        memory=memory,
        limit=limit,
        seed=seed,
        up=up,
        units=units,
        scale=scale,
        storey_height=storey_height,
        resolution=resolution,
        furniture=furniture,
        model_path=model_path,
        weights=None if weights is None else Path(weights),
        min_quality=min_quality,
        keep_stages=keep_stages,
        keep_copies=keep_copies,
        others=others,
    )
    return open_dataset(out)
