import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from houseexpo.errors import ConfigError
from pipeline.rejection import Reason, Rejection
from pipeline.sources import mesh_file
from pipeline.sources.surfaces import Surfaces, cut
from pipeline.values import Input, Level, Mesh
from tests.builders.meshes import (
    as_trimesh,
    box,
    joined,
    one_level,
    slab,
    storey,
    turned,
    two_levels,
    walls_alone,
    y_up,
)

Y_UP = (".obj", ".glb", ".gltf")


def write(mesh: Mesh, path: Path) -> Path:
    """Write a z-up mesh in the axes that the file's format stands for."""
    turned_mesh = y_up(mesh) if path.suffix in Y_UP else mesh
    as_trimesh(turned_mesh).export(path)
    return path


def read(path: Path, **options: str) -> list[Level]:
    return [level for item in mesh_file.find(str(path), **options) for level in mesh_file.read(item)]


def plan_length(level: Level, height: float) -> float:
    surfaces = Surfaces.of(level.walls)
    segments = cut(surfaces, surfaces.walls(), height)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())


def section_points(level: Level, height: float) -> np.ndarray:
    """Ends of the section's segments in the source's plan axes, sorted."""
    surfaces = Surfaces.of(level.walls)
    ends = cut(surfaces, surfaces.walls(), height).reshape(-1, 2)
    matrix = np.asarray(level.frame.matrix)
    points = np.round(ends @ matrix[:, :2].T + matrix[:, 2], 4)
    return np.unique(points, axis=0)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".gltf", ".stl", ".off"])
def test_one_chiral_house_is_one_level_in_every_format(tmp_path, suffix):
    expected = one_level()
    (level,) = read(write(expected, tmp_path / f"house{suffix}"))
    assert level.walls.faces.shape == expected.faces.shape
    corners = level.walls.vertices[level.walls.faces]
    assert corners == pytest.approx(expected.vertices[expected.faces], abs=1e-5)
    assert level.frame.up == ("y" if suffix in Y_UP else "z")
    assert level.frame.floor == pytest.approx(0.0, abs=1e-6)
    assert level.floor is not None
    assert level.floor.area == pytest.approx(39.0, abs=0.01)


def test_frame_takes_the_plan_back_to_the_sources_axes(tmp_path):
    moved = turned(one_level(), 0.0, (10.0, 20.0, 3.0))
    (flat,) = read(write(moved, tmp_path / "house.ply"))
    (upright,) = read(write(moved, tmp_path / "house.obj"))
    x, y = section_points(flat, 1.0).T
    source_x, source_z = section_points(upright, 1.0).T
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((10.0, 18.0, 20.0, 26.0), abs=1e-4)
    assert (source_x.min(), source_x.max(), source_z.min(), source_z.max()) == pytest.approx(
        (10.0, 18.0, -26.0, -20.0), abs=1e-4
    )
    assert flat.frame.floor == pytest.approx(3.0, abs=1e-5)
    assert upright.frame.floor == pytest.approx(3.0, abs=1e-5)


def test_a_house_far_from_its_origin_is_brought_near(tmp_path):
    path = tmp_path / "far.obj"
    as_trimesh(turned(walls_alone(), 0.0, (691_000.0, 5_330_000.0, 400.0))).export(path, digits=4)
    (level,) = read(path)
    assert np.abs(level.walls.vertices).max() < 10.0
    low = section_points(level, 1.0).min(axis=0)
    assert level.frame.up == "z"
    assert low == pytest.approx((691_000.0, 5_330_000.0), abs=1e-3)
    assert level.frame.floor == pytest.approx(400.0, abs=1e-3)


@pytest.mark.parametrize(("units", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)])
@pytest.mark.parametrize("make", [one_level, walls_alone, two_levels])
def test_units_are_found(tmp_path, units, metres, make):
    mesh = make()
    path = write(Mesh(mesh.vertices / metres, mesh.faces), tmp_path / "house.ply")
    levels = read(path)
    assert {level.provenance["units"] for level in levels} == {units}
    assert np.ptp(levels[0].walls.vertices[:, 0]) == pytest.approx(8.0, abs=1e-3)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_an_axis_against_the_convention_is_found_and_can_be_given(tmp_path, suffix):
    mesh = one_level() if suffix == ".obj" else y_up(one_level())
    path = tmp_path / f"house{suffix}"
    as_trimesh(mesh).export(path)
    up = "z" if suffix == ".obj" else "y"
    (found,), (given_up,) = read(path), read(path, up=up, units="m")
    assert found.frame.up == given_up.frame.up == up
    assert np.array_equal(found.walls.vertices, given_up.walls.vertices)


def test_a_tower_keeps_its_formats_axis(tmp_path):
    """Higher than it is deep: the convention decides, not the flatness."""
    floors = [2.8 * k for k in range(4)]
    parts = [part for z in floors for part in (*slab(z - 0.3, z), *storey(z, z + 2.5))]
    levels = read(write(joined(parts), tmp_path / "tower.glb"))
    assert [level.frame.floor for level in levels] == pytest.approx(floors, abs=1e-5)
    assert {level.frame.up for level in levels} == {"y"}


def test_collada_says_its_axis_and_unit(tmp_path):
    pytest.importorskip("collada")
    path = tmp_path / "house.dae"
    mesh = one_level()
    as_trimesh(Mesh(mesh.vertices / 0.0254, mesh.faces)).export(path)
    text = path.read_text()
    head = '<asset><unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis>'
    start, end = text.index("<asset>"), text.index("</asset>")
    path.write_text(text[:start] + head + text[end:])
    (level,) = read(path)
    assert (level.provenance["units"], level.frame.up) == ("in", "z")
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0, abs=1e-4)


def test_a_scene_is_put_together_with_its_transforms(tmp_path):
    mesh = as_trimesh(y_up(walls_alone()))
    scene = trimesh.Scene()
    scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([5.0, 0.0, 0.0]))
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene.add_geometry(mesh, transform=mirrored)
    path = tmp_path / "scene.glb"
    scene.export(path)
    (level,) = read(path)
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(8.0 + 13.0, abs=1e-5)
    assert as_trimesh(level.walls).volume == pytest.approx(2 * as_trimesh(walls_alone()).volume, rel=1e-6)


def test_a_missing_material_does_not_matter(tmp_path):
    path = write(one_level(), tmp_path / "house.obj")
    path.write_text("mtllib nowhere.mtl\nusemtl none\n" + path.read_text())
    assert len(read(path)) == 1


def test_ids_and_provenance_hold_no_path_of_the_machine(tmp_path):
    folder = tmp_path / "Häuser"
    (folder / "Ost").mkdir(parents=True)
    write(two_levels(), folder / "Ost" / "Haus 7.PLY".lower())
    write(one_level(), folder / "a.stl")
    (folder / "notes.txt").write_text("no mesh")
    items = list(mesh_file.find(str(folder)))
    assert [item.id for item in items] == ["ost_haus_7", "a"]
    assert [item.id for item in mesh_file.find(str(folder / "a.stl"))] == ["hauser_a"]
    levels = list(mesh_file.read(items[0]))
    assert [level.id for level in levels] == ["ost_haus_7_L0", "ost_haus_7_L1"]
    assert [level.frame.level for level in levels] == [0, 1]
    assert levels[0].provenance["file"] == "Ost/haus 7.ply"
    assert len(levels[0].provenance["sha256"]) == 64
    assert str(tmp_path) not in str(levels[0].provenance)


@pytest.mark.parametrize("options", [{"up": "x"}, {"units": "furlong"}, {"scale": "-2"}, {"scales": "2"}])
def test_an_unknown_option_is_refused(tmp_path, options):
    with pytest.raises(ConfigError, match=next(iter(options))):
        list(mesh_file.find(str(tmp_path), **options))


@settings(max_examples=15, deadline=None)
@given(st.floats(0, 360), st.floats(-400, 400), st.floats(-400, 400), st.floats(-50, 50))
def test_a_moved_house_gives_the_moved_levels(tmp_path_factory, angle, x, y, z):
    folder = tmp_path_factory.mktemp("moved")
    moved = turned(two_levels(), angle, (x, y, z))
    path = folder / "house.ply"
    as_trimesh(moved).export(path)
    still = two_levels()
    as_trimesh(still).export(folder / "still.ply")
    expected = read(folder / "still.ply")
    found = list(mesh_file.read(Input("moved", "mesh_file", str(path))))
    assert [level.frame.floor - z for level in found] == pytest.approx([0.0, 2.8], abs=1e-3)
    for level, same in zip(found, expected, strict=True):
        assert level.ceiling_m == pytest.approx(same.ceiling_m, abs=2e-3)
        assert plan_length(level, 1.0) == pytest.approx(plan_length(same, 1.0), abs=0.02)
        assert level.floor is not None
        assert level.floor.area == pytest.approx(39.0, abs=0.05)


def scaled(mesh: Mesh, by: float) -> Mesh:
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


def test_a_unit_that_cannot_be_decided_shows_the_sizes(tmp_path):
    path = write(scaled(walls_alone(), 1 / 3), tmp_path / "model.glb")
    with pytest.raises(Rejection, match=r"bad_units.*in: 0\.06773 m.*--scale") as caught:
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
