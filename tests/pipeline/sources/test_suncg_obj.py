"""The small OBJ reader: equal to trimesh's loader on what houses are made of, strict about all else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import trimesh

from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes import obj
from pipeline.sources.procedural import write_houses


def _triangles(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return all triangles' corners (n, 9), sorted, so that neither order nor welding matters."""
    flat = vertices[faces].reshape(-1, 9).round(6)
    return flat[np.lexsort(flat.T)]


def test_equals_trimesh_on_all_files_of_generated_houses(tmp_path: Path) -> None:
    write_houses(tmp_path, 4, seed=5)
    paths = sorted(tmp_path.glob("room/*/*.obj"))
    assert len(paths) > 20
    for path in paths:
        ours = obj.parse(path.read_bytes(), path.name)
        theirs = trimesh.load_mesh(path, process=False, maintain_order=True, skip_materials=True)
        assert np.array_equal(_triangles(ours.vertices, ours.faces), _triangles(theirs.vertices, theirs.faces))


@pytest.mark.parametrize("corner", ["{}", "{}/1", "{}//1", "{}/1/1"])
def test_takes_every_way_to_write_a_corner(corner: str) -> None:
    face = " ".join(corner.format(i) for i in (1, 2, 3, 4))
    mesh = obj.parse(f"v 0 0 0\nv 1\t0 0\r\nv 1 1 0\nv 0 1 0\nvt 0 0\nf {face}\n".encode(), "a")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_a_corner_written_otherwise_than_the_rest_is_read_as_it_stands() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 2/2 3/3\nf 2/2/2 3/ 1/1\nf 3 1/9 2//7\n"
    assert obj.parse(text.encode(), "a").faces.tolist() == [[0, 1, 2], [1, 2, 0], [2, 0, 1]]


def test_triangles_and_larger_polygons_mix() -> None:
    mesh = obj.parse(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0\nf 1 2 3\nf 1 2 5 3 4\n", "a")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 4], [0, 4, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("text", "reason", "says"),
    [
        ("", Reason.EMPTY, "is empty"),
        ("hello\n", Reason.UNREADABLE, "found none"),
        ("v 0 0 0\n", Reason.EMPTY, "no faces"),
        ("v 0 0\nv 1 0\nv 1 1\nf 1 2 3\n", Reason.UNREADABLE, "expected 3 numbers"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\n", Reason.UNREADABLE, "'f 1 2'"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n", Reason.UNREADABLE, "vertex 4 of 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -1 -2 -3\n", Reason.UNREADABLE, "a face names"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 c\n", Reason.UNREADABLE, "expected a vertex number"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/1 /2 3/3\n", Reason.UNREADABLE, "expected a vertex number"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 99999999999999999999 2 3\n", Reason.UNREADABLE, "of 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 99999999999999999999 2 3 1\n", Reason.UNREADABLE, "a vertex number"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 1e999\nf 1 2 3\n", Reason.NOT_FINITE, "vertex 3"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 2 2 0\nf 1 2 3\n", Reason.UNREADABLE, "breaks off"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3", Reason.UNREADABLE, "breaks off"),
    ],
)
def test_says_what_is_wrong(text: str, reason: Reason, says: str) -> None:
    with pytest.raises(Rejection) as caught:
        obj.parse(text.encode(), "wall.obj")
    assert caught.value.reason == reason
    assert says in caught.value.detail
    assert "wall.obj" in caught.value.detail


def test_a_closed_mesh_may_end_without_a_line_end() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4"
    assert len(obj.parse(text.encode(), "a").faces) == 4


def test_finds_the_material_file() -> None:
    assert obj.material_file(b"# a\nmtllib two words.mtl\r\nv 0 0 0\n") == "two words.mtl"
    assert obj.material_file(b"v 0 0 0\n# mtllib none\n") is None
