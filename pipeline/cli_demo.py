"""Define ``houseexpo demo``: write example houses and a manifest to a folder, and build plans of made homes there."""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Final

import typer

from houseexpo.commands.arguments import Processes

PLANS: Final = 30
"""How many homes are made and built: enough for a gallery, a matter of seconds."""
_SEED: Final = 2019


def demo(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder to write to.", show_default="the current folder")
    ] = Path(),
    plans: Annotated[int, typer.Option(min=0, help="Number of homes to make and build in plans/demo.")] = PLANS,
    workers: Processes = None,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite files that houseexpo did not write.")] = False,
) -> None:
    """Write the example houses of the documentation, and build plans of made homes.

    Writes house.glb, house.ifc, houses/, houses.toml and corrections.toml. Builds plans/demo if it does not exist.
    """
    from houseexpo.commands.printing import make_console
    from houseexpo.outputs import CommandOutput
    from pipeline.cli_build import from_python

    examples = files("pipeline") / "examples"
    with CommandOutput(folder, replace=replace, folder=True) as output:
        names = _names(examples)
        for name in names:
            output.check(folder / name)
        for name in names:
            output.write(folder / name, (examples / name).read_bytes())
    print_to = make_console()
    print_to.print(f"{folder / 'house.glb'}, {folder / 'house.ifc'}: two houses", highlight=False, soft_wrap=True)
    print_to.print(f"{folder / 'houses'}: houses in seven formats", highlight=False, soft_wrap=True)
    print_to.print(
        f"{folder / 'houses.toml'}, {folder / 'corrections.toml'}: a manifest, and corrections of one house",
        highlight=False,
        soft_wrap=True,
    )
    target = folder / "plans" / "demo"
    if plans and not target.exists():
        from houseexpo.dataset import open_dataset
        from houseexpo.processes import count_cores

        homes = [f"procedural:{plans}"]
        from_python(
            homes,
            str(target),
            config=None,
            overrides=None,
            workers=workers or count_cores(),
            others="refuse",
            seed=_SEED,
        )
        print_to.print(f"{target}: {len(open_dataset(target))} plans of made homes", highlight=False, soft_wrap=True)
    here = "" if folder == Path() else f"cd {folder} && "
    print_to.print(f"next      {here}houseexpo build house.glb --out plans/house", highlight=False, soft_wrap=True)
    if target.exists():
        print_to.print(f"          {here}houseexpo serve plans/demo", highlight=False, soft_wrap=True)


def _names(folder: Traversable, within: str = "") -> list[str]:
    """Return the files in a folder of the package, by their paths in it."""
    found = []
    for each in sorted(folder.iterdir(), key=lambda each: each.name):
        name = f"{within}{each.name}"
        if each.is_dir() and each.name != "__pycache__":
            found += _names(each, f"{name}/")
        elif each.is_file():
            found.append(name)
    return found
