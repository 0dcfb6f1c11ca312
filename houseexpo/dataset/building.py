"""Build a data set from Python, as ``houseexpo build`` does on the command line."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final, Literal

from houseexpo.dataset.opening import Dataset, open_dataset
from houseexpo.errors import ConfigError, MissingDependencyError

GROUP: Final = "houseexpo.builders"
"""The entry points of this group build data sets; the pipeline brings one."""

Place = str | os.PathLike[str]


def build(
    source: Place | Iterable[Place],
    out: Place,
    *,
    config: Place | None = None,
    overrides: Place | None = None,
    workers: int | None = None,
    limit: int | None = None,
    seed: int | None = None,
    up: Literal["auto", "y", "z"] | None = None,
    units: str | None = None,
    scale: float | None = None,
    storey_height: float | None = None,
    furniture: bool | None = None,
    model_path: str | None = None,
    min_quality: float | None = None,
    keep_stages: bool | None = None,
    others: Literal["refuse", "add", "replace"] = "refuse",
) -> Dataset:
    """Build a data set of floor plans from 3D houses, and open it.

    A build that was interrupted goes on where it stopped. The same houses and options give the same bytes, whatever the
    number of workers. ``plans.rejected`` says which houses gave no plan, and why.

    Parameters
    ----------
    source
        A mesh, an IFC file, a folder of such files, a SUNCG root, ``"procedural:20"`` for homes that are made, or
        several of these; ``()`` where ``config`` names them.
    out
        The folder of the data set. It is made where it is missing.
    config
        A manifest: a TOML file with sources and parameters, or the name of one that comes with houseexpo ("demo").
    overrides
        A TOML file of corrections by hand.
    workers
        Processes; one for each core by default.
    limit
        Take the first houses only, so many.
    seed
        The seed of everything that is drawn at random; 0 by default.
    up, units, scale, storey_height
        The up axis, the unit ("mm", "ft", or metres in a unit), the scale (20 for a model at 1:20) and the height of a
        storey in metres of mesh files; found out where they are not given.
    furniture
        Whether furniture is an obstacle too.
    model_path
        Folders with Gazebo models, divided as in PATH.
    min_quality
        Reject plans of which the pipeline is less sure, 0 to 1.
    keep_stages
        Whether to keep a picture of the stages beside each plan.
    others
        What becomes of plans of other sources that ``out`` holds: "refuse" to build, "add" the new ones to them, or
        "replace" them.

    Returns
    -------
    The data set; empty where nothing became a plan.

    Raises
    ------
    ConfigError
        A source does not exist, an option has no such value, or ``out`` holds something else.

    Examples
    --------
    >>> import tempfile
    >>> plans = build("procedural:1", tempfile.mkdtemp(), workers=1)
    >>> len(plans), plans.rejected
    (1, [])
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not found:
        raise MissingDependencyError("houseexpo.build: no pipeline is installed; install houseexpo as a whole again")
    if others not in {"refuse", "add", "replace"}:
        raise ConfigError(f"others: expected 'refuse', 'add' or 'replace', found {others!r}")
    sources = [source] if isinstance(source, (str, os.PathLike)) else list(source)
    run = next(iter(found.values())).load()
    run(
        [os.fspath(each) for each in sources],
        os.fspath(out),
        config=None if config is None else Path(config),
        overrides=None if overrides is None else Path(overrides),
        workers=workers,
        limit=limit,
        seed=seed,
        up=up,
        units=units,
        scale=scale,
        storey_height=storey_height,
        furniture=furniture,
        model_path=model_path,
        min_quality=min_quality,
        keep_stages=keep_stages,
        others=others,
    )
    return open_dataset(out)
