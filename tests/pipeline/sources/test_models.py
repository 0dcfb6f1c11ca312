"""Models to a scale, told by the heads of their doors; houses that look like one and stay what they are."""

from pathlib import Path

import pytest

from pipeline.sources import mesh_file
from pipeline.values import Level, Mesh
from tests.builders.houses import Hole, Parts, gap, shell, wall, window
from tests.builders.meshes import as_trimesh, box, joined, y_up


def level_of(parts: Parts, path: Path, unit_m: float) -> Level:
    """Read the house, written with a unit of so many metres, and the axes of its format."""
    mesh = joined(parts)
    scaled = Mesh(mesh.vertices / unit_m, mesh.faces)
    as_trimesh(y_up(scaled) if path.suffix == ".glb" else scaled).export(path)
    (level,) = [level for item in mesh_file.find(str(path)) for level in mesh_file.read(item)]
    return level


def house(top: float = 2.5, upstairs: bool = False) -> Parts:
    """Two rooms with a front door, a door between them and windows; with the like upstairs and no floor there."""
    front = [Hole(0.5, 1.5, 0.0, 2.05), window(2.0, 3.5), window(5.0, 6.5)]
    inner = [Hole(1.0, 1.9, 0.0, 2.05)]
    if upstairs:
        return [
            *house(2.8),
            *(part.apply_translation((0, 0, 2.8)) for part in house(2.6)),
        ]
    walls = [wall((-0.2, -0.2, 7.4, 0.0), *front, top=top), wall((4.0, 0.0, 4.2, 3.0), *inner, top=top)]
    others = [(-0.2, 3.0, 7.4, 3.2), (-0.2, 0.0, 0.0, 3.0), (7.2, 0.0, 7.4, 3.0)]
    return [part for made in (*walls, *(wall(other, top=top) for other in others)) for part in made]


@pytest.mark.parametrize("unit_m", [20.0, 0.5, 0.381, 0.2, 0.15])
@pytest.mark.parametrize("suffix", [".glb", ".ply"])
def test_a_model_is_told_by_its_doors_though_its_format_says_metres(tmp_path: Path, suffix: str, unit_m: float) -> None:
    level = level_of(house(), tmp_path / f"model{suffix}", unit_m)
    assert level.walls.vertices[:, 0].max() == pytest.approx(7.4, abs=0.01)
    assert "scale" in level.guesses


@pytest.mark.parametrize("parts", [house(), house(4.4), house(upstairs=True)], ids=["house", "loft", "no inner slab"])
def test_a_house_in_metres_stays_what_its_format_says(tmp_path: Path, parts: Parts) -> None:
    level = level_of(parts, tmp_path / "house.glb", 1.0)
    assert level.walls.vertices[:, 0].max() == pytest.approx(7.4, abs=0.01)
    assert not level.guesses


def test_a_hall_with_doors_of_the_usual_height_is_no_model(tmp_path: Path) -> None:
    hall = [*shell((0.0, 0.0, 20.0, 9.0), front=[Hole(1.0 + 3 * k, 2.0 + 3 * k) for k in range(4)])]
    sides = ((-0.2, -0.2, 20.2, 0.0), (-0.2, 9.0, 20.2, 9.2), (-0.2, 0.0, 0.0, 9.0), (20.0, 0.0, 20.2, 9.0))
    raised = [box(side, 2.5, 7.0) for side in sides]
    level = level_of([*hall, *raised], tmp_path / "hall.glb", 1.0)
    assert level.walls.vertices[:, 0].max() == pytest.approx(20.2, abs=0.01)


def test_tops_of_furniture_are_no_heads_where_the_storey_is_usual_in_metres(tmp_path: Path) -> None:
    """Doors to the ceiling, and shelves on two walls that end at 1.65 m: heads of a model at 1:50, in inches."""
    rooms = [*shell((0.0, 0.0, 7.2, 3.0), front=[gap(1.0, 2.0)]), *wall((4.0, 0.0, 4.2, 3.0), gap(1.0, 2.0))]
    shelves = [box((x, 2.6, x + 1.8, 3.0), 1.25, 1.65) for x in (0.1, 2.0, 5.0)]
    level = level_of([*rooms, *shelves], tmp_path / "world.ply", 1.0)
    assert level.provenance["units"] == "m"


def test_the_base_of_a_model_is_not_its_storeys_foot(tmp_path: Path) -> None:
    base = [box((-3.0, -3.0, 10.2, 6.0), -0.4, -0.25), box((-0.2, -0.2, 7.4, 3.2), -0.2, 0.0)]
    level = level_of([*house(2.9), *base], tmp_path / "model.ply", 0.2)
    assert level.provenance["units"] == "0.2 m"
    assert level.frame.floor == pytest.approx(0.0, abs=0.01)
