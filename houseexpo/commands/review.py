"""``houseexpo review``: build houses that are not built yet, and open the page on which their plans are corrected."""

from __future__ import annotations

import hashlib
import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Final

import typer

from houseexpo.commands.serve import announce, browser_address, listening_service, run_service
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset

_SHOWN: Final = 8
"""Rejections that are printed; ``rejected.jsonl`` has all."""


def review(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE|FOLDER|DATASET",
            help="What houseexpo build takes (a mesh, an IFC file, a robot's map, a folder of such files, ...), or a "
            "data set.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the data set that is built; the corrections are kept there too.",
            show_default="in the user's cache",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Number of processes of the build.", show_default="one per core")
    ] = None,
    weights: Annotated[
        Path | None,
        typer.Option(help="File of weights for the build, from houseexpo fit.", show_default="those of houseexpo"),
    ] = None,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = True,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 0,
    with_token: Annotated[
        bool, typer.Option("--token", help="Require the token in the address on this machine too.")
    ] = False,
) -> None:
    """Correct plans in the browser: build what is not built yet, and open the Review page.

    A build that was done before is not done again. Corrections go to overrides.toml in the data set, and every later
    build of it applies them.
    """
    with listening_service("127.0.0.1", port, with_token=with_token, review=True) as (settings, listening):
        from houseexpo.service.collection import open_collections
        from houseexpo.service.service import Service

        dataset = data_set_of(sources, out, workers, weights)
        service = Service(open_collections([dataset.path]), settings)
        announce(service)
        address = browser_address(settings, f"{next(iter(service.collections))}/review")
        typer.echo(f"open {address} in a browser; Ctrl-C ends it")
        if open_page and _has_browser():
            Thread(target=webbrowser.open, args=(address,), daemon=True).start()  # some browsers do not return
        run_service(service, listening)


def data_set_of(
    sources: Sequence[str], out: Path | None, workers: int | None = None, weights: Path | None = None
) -> Dataset:
    """Return the data set that is named, or that of the named houses, which are built if they are not yet.

    If no house became a plan, the reasons are printed; the page opens the houses all the same.

    Raises
    ------
    ConfigError
        A source does not exist, ``out`` holds something else, or it or ``weights`` is given with a data set.
    """
    from houseexpo import build
    from houseexpo.dataset.store import files_at

    if len(sources) == 1 and (found := open_if_data_set(files_at(sources[0], "review"))) is not None:
        if out is not None:
            raise ConfigError(f"--out: {sources[0]} is built already, and its corrections go there; leave --out out")
        if weights is not None:
            raise ConfigError(f"--weights: {sources[0]} is built already; build it again: houseexpo build --weights")
        return found
    folder = out or build_folder(sources)
    typer.echo(f"builds {folder}")
    made = build(list(sources), folder, workers=workers, weights=weights)
    if not len(made):
        for each in made.rejected[:_SHOWN]:
            typer.secho(f"{each['id']}: {each['reason'].replace('_', ' ')}: {each['detail']}", fg="red", err=True)
        what = count_noun(len(made.rejected), "input")
        typer.secho(f"none of {what} became a plan; the page shows what was found, to be corrected", err=True)
    return made


def open_if_data_set(place: Path) -> Dataset | None:
    """Return the data set at a place; None if what lies there is not one."""
    from houseexpo.dataset import open_dataset

    if not place.exists():
        return None
    try:
        found = open_dataset(place)
        return found if len(found) or (place / "manifest.json").is_file() else None
    except HouseExpoError:
        if (place / "manifest.json").is_file() and (place / "index.parquet").is_file():
            raise  # a data set, but a damaged one
        return None


def build_folder(sources: Sequence[str]) -> Path:
    """Return the folder in the user's cache for the data set of some sources, named after the first one."""
    from houseexpo.files import cache_folder

    places = [os.path.realpath(source) if Path(source).exists() else source for source in sources]
    digest = hashlib.sha256("\n".join(places).encode(errors="surrogateescape")).hexdigest()[:12]
    name = Path(places[0]).stem.replace(":", "-").lstrip(".") or "houses"
    return cache_folder("reviews", digest) / name


def _has_browser() -> bool:
    """Return whether a window can be opened; a browser in the terminal would take the terminal."""
    return sys.platform in {"darwin", "win32"} or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))
