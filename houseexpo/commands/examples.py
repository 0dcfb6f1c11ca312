"""Examples of the commands, which stand at the end of a command's ``--help``."""

from __future__ import annotations

from typing import Final

EXAMPLES: Final = {
    "demo": ("demo try",),
    "build": (
        "build house.glb --out plans/house",
        "build houses/ --out plans/houses --min-quality 0.8",
        "build map.yaml --out plans/map",
        "build procedural:20 --seed 7 --out plans/homes",
    ),
    "inspect": ("inspect house.glb --out pictures", "inspect houses/ --id villa_L1 --out pictures"),
    "assemble": ("assemble plans/shared",),
    "slurm": ("slurm houses.toml --shards 256 --out plans/all --submit",),
    "fetch": ("fetch --subset 100",),
    "info": ("info plans/demo", "info plans/house/json/try_house.json"),
    "show": ("show plans/demo --sample 12 --out plans.png", "show try_house --dataset plans/house --out house.svg"),
    "serve": ("serve plans/demo", "serve plans/demo plans/houses --port 8080"),
    "stats": ("stats plans/demo --out report.html", "stats plans/demo --list-bad --radius 0.3"),
    "validate": ("validate plans/demo",),
    "export": (
        "export plans/demo --to ros --out maps",
        "export plans/house --to glb --building house --out meshes",
    ),
    "split": ("split plans/demo --train 0.7 --val 0.1 --test 0.2",),
    "release": ("release plans/demo --out release",),
    "play": ("play plans/demo", "play map.yaml"),
    "record": ("record plans/demo --policy frontier --out run.gif",),
    "replay": ("replay run.mcap --out map",),
    "ros": ("ros plans/demo --map slam",),
    "train": ("train exploration plans/demo --out run",),
    "observe": ("observe plans/demo --limit 1000 --out pairs",),
    "prepare": ("prepare plans/demo",),
}
"""Arguments that follow ``houseexpo``, by the name of the command."""


def examples_text(name: str) -> str | None:
    """Return the examples of a command as the end of its help, a paragraph for each line; None if it has none."""
    lines = [f"houseexpo {example}" for example in EXAMPLES.get(name, ())]
    return "\n\n".join(["Examples:" if len(lines) > 1 else "Example:", *lines]) if lines else None
