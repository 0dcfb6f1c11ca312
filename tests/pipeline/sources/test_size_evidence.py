"""Tests for the scale that the sizes of openings, walls and named things tell."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.sources.mesh_file import measure_named_things
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.storeys.axis_and_unit import UprightShape
from pipeline.sources.storeys.size_evidence import (
    NamedThing,
    SizesFound,
    distinct_sizes,
    kinds_by_word,
    log_likelihood,
    measure_openings,
    other_scales,
    usual_sizes,
    weigh_scale,
)
from pipeline.sources.storeys.surfaces import Surfaces
from pipeline.values import Mesh
from tests.builders.meshes import as_trimesh, box, joined, read, storey, y_up

WIDTHS = (0.9, 0.8, 1.4)


def house() -> Mesh:
    """Walls of 2.7 m in a plan of 9 x 6 m, with a partition of 0.15 m and openings of three widths in it."""
    walls = [(0.0, 0.0, 9.0, 0.2), (8.8, 0.2, 9.0, 5.8), (0.0, 5.8, 9.0, 6.0), (0.0, 0.2, 0.2, 5.8)]
    y, parts = 0.2, []
    for width in WIDTHS:
        parts.append((4.0, y, 4.15, y + 0.6))
        y += 0.6 + width
    lintels = [box((4.0, 0.2, 4.15, 5.8), 2.08, 2.7)]
    return joined([*storey(0.0, 2.7, [*walls, *parts, (4.0, y, 4.15, 5.8)]), *lintels])


def things() -> dict[str, Mesh]:
    """A bed, a chair, and a desk of two nodes, all of usual sizes."""
    return {
        "Bed_01": box((0.5, 0.5, 2.5, 2.1), 0.0, 0.5),
        "Chair.002": box((6.0, 3.0, 6.45, 3.5), 0.0, 0.85),
        "Desk": box((6.0, 1.0, 7.4, 1.7), 0.0, 0.74),
    }


def written(path: Path, by: float, names: dict[str, Mesh]) -> Path:
    """Write the house and what stands in it, ``by`` times as large."""
    scene = trimesh.Scene()
    for name, mesh in {"walls": house(), **names}.items():
        scene.add_geometry(as_trimesh(y_up(Mesh(mesh.vertices * by, mesh.faces))), node_name=name)
    scene.export(path)
    return path


@pytest.mark.parametrize("by", [1.0, 0.01, 40.0])
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_openings_are_found_with_the_thickness_of_their_walls(by: float, turn: float) -> None:
    mesh = house()
    cos, sin = math.cos(turn), math.sin(turn)
    turned = mesh.vertices @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for axis, order in ((2, [0, 1, 2]), (1, [0, 2, 1])):
        surfaces = Surfaces.of(Mesh(turned[:, order] * by, mesh.faces))
        widths, thicknesses = measure_openings(surfaces, axis, 0.0, 2.7 * by)
        assert distinct_sizes(widths) == pytest.approx([width * by for width in sorted(WIDTHS)])
        assert distinct_sizes(thicknesses) == pytest.approx([0.15 * by])


def test_a_house_without_openings_has_none() -> None:
    surfaces = Surfaces.of(joined([box((0.0, 0.0, 4.0, 3.0), 0.0, 2.5)]))
    assert measure_openings(surfaces, 2, 0.0, 2.5) == ([], [])


def test_named_things_are_measured_by_their_node_and_all_that_hangs_on_it(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for name, parent, mesh in (
        ("Chair_3", "world", box((0.0, 0.0, 0.4, 0.4), 0.4, 0.5)),
        ("leg", "Chair_3", box((0.0, 0.0, 0.05, 0.05), 0.0, 0.4)),
        ("back", "Chair_3", box((0.0, 0.0, 0.05, 0.4), 0.5, 0.9)),
        ("tables", "world", box((3.0, 3.0, 9.0, 5.0), 0.0, 0.7)),
        ("floor lamp", "world", box((2.0, 2.0, 2.3, 2.3), 0.0, 1.6)),
    ):
        scene.add_geometry(as_trimesh(y_up(mesh)), node_name=name, parent_node_name=parent)
    scene.export(tmp_path / "room.glb")
    found = measure_named_things(load_scene(tmp_path / "room.glb"))
    (chair,) = found["y"]
    assert chair.kind == "thing.chair"
    assert (chair.height, chair.length) == pytest.approx((0.9, 0.9))
    assert found["z"][0].height == pytest.approx(0.4)


def test_the_table_of_sizes_holds_together() -> None:
    usual = usual_sizes()
    assert set(kinds_by_word().values()) <= set(usual)
    grid = np.arange(-20.0, 20.0, 0.01)
    for kind, size in usual.items():
        assert (size.side in {"height", "length"}) == kind.startswith("thing."), kind
        rest = 1.0 - sum(share for share, _, _ in size.parts)
        assert 0.0 < rest < 0.5
        whole = np.exp(size.log_density(grid)) - np.exp(size.log_density(np.array([-1e3])))
        assert whole.sum() * 0.01 == pytest.approx(1.0 - rest, abs=1e-3)


def usual(by: float, **more: object) -> SizesFound:
    """What a usual flat measures, ``by`` times as large."""
    parts = {"heads": (2.05,), "widths": (0.8, 0.9, 1.4), "thicknesses": (0.12, 0.2)}
    sized = {name: tuple(size * by for size in sizes) for name, sizes in parts.items()}
    return SizesFound(**{"storey": 2.7 * by, "extent": 10.0 * by, **sized, **more})  # type: ignore[arg-type]


def test_the_likeliest_scale_is_the_true_one() -> None:
    log_metres = np.arange(-5.0, 5.0, 0.01)
    best = log_metres[log_likelihood(usual(20.0), log_metres).argmax()]
    assert math.exp(best) == pytest.approx(1 / 20.0, rel=0.1)


@pytest.mark.parametrize(("by", "metres"), [(100.0, 0.01), (1000.0, 0.001), (10.0, 0.1), (0.0254, 1 / 0.0254)])
def test_another_unit_that_is_clearly_likelier_is_taken(by: float, metres: float) -> None:
    assert weigh_scale(usual(by), 1.0, None, 1e-4, 1e3) == pytest.approx(metres)


def test_other_sizes_are_those_that_make_doors_and_storeys_usual() -> None:
    """``other_scales`` is given what was found in metres, as it was read."""
    others, is_odd = other_scales(usual(1.0), 1.0)
    assert not is_odd
    others, is_odd = other_scales(usual(0.5), 1.0)
    assert is_odd
    assert others[0] == pytest.approx(2.0, rel=0.15)
    others, is_odd = other_scales(usual(100.0, storey=0.0), 0.3048)
    assert is_odd
    assert others[0] in {0.003, 0.00305} or others[0] == pytest.approx(0.003, rel=0.15)


def test_an_answer_stays_that_is_about_as_likely() -> None:
    for given in (0.92, 1.0, 1.08):
        assert weigh_scale(usual(1.0), given, None, 0.1, 10.0) == given


def test_storeys_and_heads_alone_say_nothing_new() -> None:
    bare = usual(2.6, widths=(), thicknesses=())
    assert weigh_scale(bare, 1.0, None, 0.01, 10.0) == 1.0
    bed = NamedThing("thing.bed", 0.5 * 2.6, 2.0 * 2.6)
    assert weigh_scale(usual(2.6, widths=(), thicknesses=(), things=(bed,)), 1.0, None, 0.01, 10.0) < 0.5


def test_only_what_stands_in_the_bounds_is_taken() -> None:
    assert weigh_scale(usual(100.0), 1.0, None, 0.5, 10.0) == 1.0
    assert weigh_scale(usual(100.0), 1.0, None, 10.0, 0.5) == 1.0


@pytest.mark.parametrize(
    ("suffix", "ceiling_m", "within", "guesses"), [(".obj", 2.7, 0.12, ("scale",)), (".glb", 5.94, 0.02, ())]
)
def test_a_house_that_is_too_large_is_told_by_what_stands_in_it_unless_the_format_lays_down_metres(
    tmp_path: Path, suffix: str, ceiling_m: float, within: float, guesses: tuple[str, ...]
) -> None:
    """Its storey of 5.9 m is possible in metres, and no usual scale of models makes a door of its openings."""
    (level,) = read(written(tmp_path / f"large{suffix}", 2.2, things()))
    assert level.ceiling_m == pytest.approx(ceiling_m, rel=within)
    assert level.guesses == guesses


def test_walls_in_one_plane_stand_at_no_scale():
    least, most = UprightShape(widths=(0.0, 5.0), storey=2.5, flatness=1.0, square=1.0).scales()
    assert least > most
