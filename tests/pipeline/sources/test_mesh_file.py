import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from houseexpo.errors import ConfigError
from pipeline.sources import mesh_file
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.values import Input, Level, Mesh
from tests.builders.mesh_files import Y_UP, read, write
from tests.builders.meshes import (
    as_trimesh,
    joined,
    one_level,
    slab,
    storey,
    turned,
    two_levels,
    walls_alone,
    y_up,
)


def plan_length(level: Level, height: float) -> float:
    surfaces = Surfaces.of(level.walls)
    segments = cut_at_height(surfaces, surfaces.walls(), height)
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())


def section_points(level: Level, height: float) -> np.ndarray:
    """Ends of the section's segments in the source's plan axes, sorted."""
    surfaces = Surfaces.of(level.walls)
    ends = cut_at_height(surfaces, surfaces.walls(), height).reshape(-1, 2)
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
