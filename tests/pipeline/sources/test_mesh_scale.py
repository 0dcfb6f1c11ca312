"""Units, scale and axis of a mesh file: what it declares, what the house shows, what a person says."""

import re

import numpy as np
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.values import Mesh
from tests.builders.mesh_files import read, write
from tests.builders.meshes import (
    as_trimesh,
    box,
    joined,
    storey,
    walls_alone,
    y_up,
)


def scaled(mesh: Mesh, by: float | tuple[float, float, float]) -> Mesh:
    return Mesh(mesh.vertices * by, mesh.faces)


@pytest.mark.parametrize("options", [{"scale": "20"}, {"units": "20"}, {"storey_height": "2.5"}])
def test_a_person_decides_on_a_models_scale(tmp_path, options):
    path = write(scaled(walls_alone(), 1 / 20), tmp_path / "model.glb")
    (level,) = read(path, **options)
    assert level.ceiling_m == pytest.approx(2.5)
    assert level.guesses == ()


def test_a_model_without_doors_is_to_the_usual_scale_that_makes_its_storey_usual(tmp_path):
    (level,) = read(write(scaled(walls_alone(), 1 / 20), tmp_path / "model.glb"))
    assert level.ceiling_m == pytest.approx(2.5)
    assert level.guesses == ("scale",)


def with_doors() -> Mesh:
    """Walls of 2.7 m with lintels over gaps, in a plan of 8 x 6 m."""
    walls = [(0.0, 0.0, 8.0, 0.2), (7.8, 0.2, 8.0, 5.8), (0.0, 5.8, 8.0, 6.0), (0.0, 0.2, 0.2, 5.8)]
    inner = [(4.0, 0.2, 4.2, 2.0), (4.0, 2.9, 4.2, 4.0), (4.0, 4.9, 4.2, 5.8)]
    lintels = [box((4.0, y, 4.2, y + 0.9), 2.05, 2.7) for y in (2.0, 4.0)]
    return joined([*storey(0.0, 2.7, [*walls, *inner]), *lintels])


@pytest.mark.parametrize("unit", [1.0, 0.0254, 0.01, 0.001])
@pytest.mark.parametrize("scale", [1, 20, 50])
def test_door_heads_tell_the_unit_and_the_scale_where_none_is_declared(tmp_path, unit, scale):
    path = write(scaled(with_doors(), 1 / (unit * scale)), tmp_path / "model.ply")
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, rel=0.02)


def test_without_a_unit_a_door_in_a_usual_storey_tells_a_scale_that_is_none_of_the_usual(tmp_path):
    """Metres would make a hall of it, 40 m high, in which no opening ends as high as a door."""
    (level,) = read(write(scaled(with_doors(), 1 / 0.0677), tmp_path / "model.ply"))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.1)
    assert level.guesses == ("tried scale",)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, rel=0.05)


@pytest.mark.parametrize(("high", "metres"), [(8.9, 2.7), (2.7, 2.7)])
def test_one_named_door_tells_the_scale_where_the_storey_is_higher_than_a_dwelling(tmp_path, high, metres):
    """In a storey of a usual height a door as high as a hatch is one."""
    door = box((2.0, 0.0, 3.0, 0.05), 0.0, 2.05 if high > 5 else 1.2)
    walls = [(0.0, 0.0, 0.05, 4.0), (5.95, 0.0, 6.0, 4.0), (0.05, 3.95, 5.95, 4.0), (0.05, 0.0, 5.95, 0.05)]
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(scaled(joined(storey(0.0, 2.7, walls)), high / 2.7))), node_name="walls")
    scene.add_geometry(as_trimesh(y_up(scaled(joined([door]), high / 2.7))), node_name="door")
    scene.export(tmp_path / "room.glb")
    (level,) = read(tmp_path / "room.glb")
    assert level.ceiling_m == pytest.approx(metres, abs=0.2)


def hills(size: float = 100.0, count: int = 60) -> Mesh:
    """Terrain of triangles a few metres wide round (4, 3), level under the house and hilly around it."""
    x, y = np.meshgrid(np.linspace(-size, size, count) + 4.0, np.linspace(-size, size, count) + 3.0)
    away = np.maximum(np.hypot(x - 4.0, y - 3.0) - 12.0, 0.0)
    z = -0.3 + 0.03 * away * np.sin(x / 9.0) + 0.05 * away * np.cos(y / 13.0)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = (corner.ravel() for corner in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), faces)


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_terrain_around_a_house_says_nothing_of_its_unit(tmp_path, suffix):
    floor = as_trimesh(joined([box((0.0, 0.0, 8.0, 6.0), -0.2, 0.0)]))
    house = joined([as_trimesh(with_doors()), floor, as_trimesh(hills())])
    (level,) = read(write(house, tmp_path / f"house{suffix}"))
    assert level.ceiling_m == pytest.approx(2.7, rel=0.05)
    assert level.guesses == ()


def test_a_scale_that_no_unit_gives_is_tried_and_said(tmp_path):
    (level,) = read(write(scaled(walls_alone(), 1 / 3), tmp_path / "model.glb"))
    assert level.guesses == ("tried scale",)
    assert level.ceiling_m == pytest.approx(2.7, abs=0.1)


def test_hatches_do_not_scale_a_house_whose_metres_are_declared(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(walls_alone())), node_name="Walls")
    hatch = box((1.0, 0.05, 1.5, 0.1), 0.0, 0.6)
    scene.add_geometry(as_trimesh(y_up(Mesh(hatch.vertices, hatch.faces))), node_name="Door_of_the_cellar")
    scene.export(tmp_path / "house.glb")
    (level,) = read(tmp_path / "house.glb")
    assert level.provenance["units"] == "m"


def test_a_unit_that_cannot_be_decided_shows_the_sizes(tmp_path):
    path = write(scaled(walls_alone(), (1.0, 1.0, 0.001)), tmp_path / "model.glb")
    with pytest.raises(Rejection, match=r"bad_units.*in: 0\.\d+ m.*--scale") as caught:
        read(path)
    assert caught.value.reason is Reason.BAD_UNITS


def test_named_doors_tell_a_models_scale(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(as_trimesh(y_up(scaled(walls_alone(), 1 / 15))), node_name="Walls")
    for x in (1.0, 3.0):
        leaf = Mesh(box((x, 0.05, x + 0.9, 0.1), 0.0, 2.05).vertices, box((x, 0.05, x + 0.9, 0.1), 0.0, 2.05).faces)
        scene.add_geometry(as_trimesh(y_up(scaled(leaf, 1 / 15))), node_name=f"Door_{x}")
    scene.export(tmp_path / "model.glb")
    (level,) = read(tmp_path / "model.glb")
    assert level.ceiling_m == pytest.approx(2.5, abs=0.01)
    assert level.guesses == ("scale",)
    assert len(level.leaves) == 2


def test_a_real_room_of_three_metres_is_no_model(tmp_path):
    walls = [(0.0, 0.0, 2.9, 0.1), (2.8, 0.0, 2.9, 2.9), (0.0, 2.8, 2.9, 2.9), (0.0, 0.0, 0.1, 2.9)]
    (level,) = read(write(joined(storey(0.0, 2.5, walls)), tmp_path / "room.ply"))
    assert level.ceiling_m == pytest.approx(2.5)


@pytest.mark.parametrize(("unit", "metres"), [("inch", 0.0254), ("meter", 1.0)])
def test_a_declared_unit_stands_over_a_shell_without_an_inner_slab(tmp_path, unit, metres):
    shell = storey(
        0.0, 8.4, [(0.0, 0.0, 12.0, 0.2), (11.8, 0.0, 12.0, 9.0), (0.0, 8.8, 12.0, 9.0), (0.0, 0.0, 0.2, 9.0)]
    )
    path = tmp_path / "shell.dae"
    as_trimesh(scaled(joined(shell), 1 / metres)).export(path)
    declared = f'<unit name="{unit}" meter="{metres}"/><up_axis>Z_UP</up_axis>'
    path.write_text(
        re.sub(r"<unit[^>]*/>|<up_axis>.*?</up_axis>", "", path.read_text()).replace("</asset>", f"{declared}</asset>")
    )
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(12.0, abs=1e-3)
    assert level.frame.up == "z"
    assert level.guesses == ()


def test_a_declared_axis_stands_over_a_tower(tmp_path):
    tower = storey(0.0, 14.0, [(0.0, 0.0, 5.0, 0.2), (4.8, 0.0, 5.0, 7.0), (0.0, 6.8, 5.0, 7.0), (0.0, 0.0, 0.2, 7.0)])
    path = tmp_path / "tower.dae"
    as_trimesh(joined(tower)).export(path)
    text = re.sub(r"<up_axis>.*?</up_axis>", "", path.read_text())
    path.write_text(text.replace("</asset>", "<up_axis>Z_UP</up_axis></asset>"))
    assert [level.frame.up for level in read(path)] == ["z"]
