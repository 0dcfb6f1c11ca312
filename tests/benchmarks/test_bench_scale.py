"""How often the scale of a mesh is recovered whose unit nobody tells, by the rules and by the sizes of what is in it.

The houses of the kit are made larger or smaller by factors, and written without a unit. ``--members`` and ``--kinds``
choose the houses. "Near" is within 15%, "like" within 40%, which leaves storeys storeys and doors doors.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from pipeline.rejection import Rejection
from pipeline.sources.mesh_file import measure_named_things
from pipeline.sources.meshes.formats import FrameConvention, load_scene
from pipeline.sources.meshes.scene import MeshScene
from pipeline.sources.named_scene import named_door_heights, structural_mesh
from pipeline.sources.storeys import axis_and_unit
from pipeline.sources.storeys.axis_and_unit import SizeOptions, find_axis_and_unit
from pipeline.values import Mesh
from tests.builders.kinds.registry import make_member

KINDS = ("solids", "artist_named", "artist_unnamed", "office", "rowhouses")
FACTORS = (1.0, 0.01, 0.0254, 0.3048, 1 / 6, 2.7, 10.0, 100.0)
SEED = 29


def _off(scene: MeshScene, up: str, factor: float) -> float:
    """By which factor the scale that is found is wrong, as a logarithm without its sign."""
    larger = MeshScene(Mesh(scene.mesh.vertices * factor, scene.mesh.faces), scene.owner, scene.parts)
    doors, things = named_door_heights(larger), measure_named_things(larger)
    wish, unsaid = SizeOptions(up=up), FrameConvention(up, None)
    try:
        found = find_axis_and_unit(structural_mesh(larger), unsaid, wish, "house", doors, things=things)
    except Rejection:
        return math.inf
    return abs(math.log(found.metres * factor))


def test_scales_are_recovered(request: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = request.config.getoption("--kinds")
    members = min(request.config.getoption("--members"), 20)
    chosen = [kind for kind in KINDS if not kinds or kind in kinds.split(",")]
    houses = []
    for kind in chosen:
        for number in range(members):
            member = make_member(kind, number, SEED, tmp_path / kind)
            scene = load_scene(member.path)
            scene = MeshScene(
                Mesh(scene.mesh.vertices * member.unit_m, scene.mesh.faces), scene.owner, scene.parts, scene.left_out
            )
            houses.append((scene, member.up))
    table = Table(title=f"Scales recovered, of {len(houses)} made houses")
    for heading in ("larger by", "weighed: near", "like", "by rules alone: near", "like"):
        table.add_column(heading, justify="right")
    weighed = {factor: np.array([_off(*house, factor) for house in houses]) for factor in FACTORS}
    monkeypatch.setattr(axis_and_unit, "weigh_scale", lambda _sizes, metres, *_rest: metres)
    for factor in FACTORS:
        ruled = np.array([_off(*house, factor) for house in houses])
        figures = [f"{(each < math.log(by)).mean():.0%}" for each in (weighed[factor], ruled) for by in (1.15, 1.4)]
        table.add_row(f"{factor:.3g}", *figures)
    Console(width=110).print(table)
    assert (weighed[1.0] < math.log(1.4)).mean() > 0.9
