import numpy as np
import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.meshes.scene import Part

SQUARE = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\n"


def load(tmp_path, text):
    path = tmp_path / "house.obj"
    path.write_text(text)
    return load_scene(path)


def test_groups_and_materials_are_parts(tmp_path):
    scene = load(
        tmp_path,
        SQUARE + "o House\ng Wall\nusemtl paint\nf 1 2 3\nusemtl door\nf 1 3 4\ng Wall\nusemtl paint\nf 1 2 4\n",
    )
    assert scene.parts == (Part(("House", "Wall"), "", "paint"), Part(("House", "Wall"), "", "door"))
    assert scene.owner.tolist() == [0, 0, 1]


def test_a_group_ends_where_an_object_begins(tmp_path):
    scene = load(tmp_path, SQUARE + "g Plant\nf 1 2 3\no Wall\nf 1 3 4\n")
    assert scene.parts == (Part(("Plant",), "", ""), Part(("Wall",), "", ""))


def test_an_object_with_faces_of_its_own_ends_where_a_group_begins(tmp_path):
    scene = load(tmp_path, SQUARE + "o Wardrobe\nusemtl oak\nf 1 2 3\ng Shell_44\nf 1 3 4\n")
    assert scene.parts == (Part(("Wardrobe",), "", "oak"), Part(("Shell_44",), "", "oak"))


@pytest.mark.parametrize("face", ["f 1/1/1 2//2 3/3 4", "f -4 -3 -2 -1", "f 1 2 3 4 # a comment", "f 1 2 \\\n3 4"])
def test_every_way_to_write_a_face(tmp_path, face):
    scene = load(tmp_path, SQUARE + face + "\n")
    corners = scene.mesh.vertices[scene.mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.tolist() == pytest.approx([3.0, 3.0])


def test_colours_and_weights_are_dropped(tmp_path):
    scene = load(tmp_path, "v 0 0 0 1 0 0\nv 2 0 0 1 0 0\nv 2 3 0 1 0 0\nf 1 2 3\n")
    assert scene.mesh.vertices.tolist() == [[0, 0, 0], [2, 0, 0], [2, 3, 0]]


@pytest.mark.parametrize("broken", ["f 1 2 x", "f 1 2 9", "f 0 1 2", "f -9 1 2", "v 1 2\nf 1 2 3", "v a b c\nf 1 2 3"])
def test_broken_lines_are_rejected(tmp_path, broken):
    with pytest.raises(Rejection) as caught:
        load(tmp_path, SQUARE + broken + "\n")
    assert caught.value.reason is Reason.UNREADABLE
