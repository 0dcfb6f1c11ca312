"""``houseexpo fetch``: download the published data set, or a part of it, into the user's cache, and print its path."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer


class SubsetSize(StrEnum):
    """The number of plans of a subset."""

    TEN = "10"
    HUNDRED = "100"
    THOUSAND = "1000"
    ALL = "all"


def fetch(
    subset: Annotated[
        SubsetSize, typer.Option(help="Number of plans; larger subsets contain smaller ones.")
    ] = SubsetSize.ALL,
    manifest: Annotated[Path | None, typer.Option(help="Manifest of another data set.", dir_okay=False)] = None,
) -> None:
    """Download the published data set into the cache, verify it and print its path.

    An interrupted download continues where it stopped. The variable HOUSEEXPO_CACHE sets the place of the cache.
    """
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    from houseexpo.commands.printing import make_console as printed
    from houseexpo.dataset import open_dataset
    from houseexpo.dataset.fetch import fetch as run_fetch
    from houseexpo.dataset.manifest import load_manifest
    from houseexpo.words import count_noun

    published = load_manifest(manifest)
    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        tasks: dict[str, Any] = {}

        def show(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what)
            bar.update(tasks[what], completed=done, total=total or None)

        folder = run_fetch(subset.value, manifest=published, progress=show)
    out = printed()
    out.print(
        f"{count_noun(len(open_dataset(folder)), 'plan')} of {published.name} ({published.licence})", highlight=False
    )
    out.print(str(folder), highlight=False, soft_wrap=True)
