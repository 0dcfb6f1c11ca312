"""Closed bodies look outwards, and are drawn once, however their author wound and doubled their faces."""

import numpy as np
import pytest
import trimesh

from pipeline.sources.meshes.scene import PartNames, Scene
from pipeline.sources.meshes.winding import turn_bodies_outwards
from pipeline.values import Mesh
from tests.builders.meshes import box, joined, sheet

WALL = (0.0, 0.0, 4.0, 0.2)
BEHIND = (0.0, 0.2, 4.0, 0.4)


def scene(*meshes: trimesh.Trimesh) -> Scene:
    """A scene of one part whose faces have corners of their own."""
    mesh = joined(meshes)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    return Scene(Mesh(corners, faces), np.zeros(len(faces), np.int32), (PartNames(),))


def wound(found: Scene, *, over: bool = False, twice: bool = False) -> Scene:
    """The scene with its faces turned over, or with each face drawn from both sides."""
    faces = found.mesh.faces[:, ::-1] if over else found.mesh.faces
    if twice:
        faces = np.concatenate([faces, faces[:, ::-1]])
    return Scene(Mesh(found.mesh.vertices, faces), np.zeros(len(faces), np.int32), found.parts)


def volume(found: Scene) -> float:
    a, b, c = found.mesh.vertices[found.mesh.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def looks(found: Scene) -> list[list[tuple[float, ...]]]:
    """The corners of each face, the lowest first, in the order of its winding; but not where both walls touch."""
    rings = [[tuple(point) for point in ring] for ring in found.mesh.vertices[found.mesh.faces].tolist()]
    turned = [ring[(k := ring.index(min(ring))) :] + ring[:k] for ring in rings]
    return sorted(ring for ring in turned if any(y != WALL[3] for _, y, _ in ring))


@pytest.mark.parametrize("over", [False, True])
@pytest.mark.parametrize("twice", [False, True])
def test_walls_look_outwards_and_are_there_once(over, twice):
    walls = scene(box(WALL, 0.0, 2.7), box(BEHIND, 0.0, 2.7))
    found = turn_bodies_outwards(wound(walls, over=over, twice=twice))
    assert looks(found) == looks(walls)


def test_the_order_of_faces_does_not_matter():
    walls = wound(scene(box(WALL, 0.0, 2.7)), twice=True)
    order = np.random.default_rng(3).permutation(len(walls.mesh.faces))
    found = turn_bodies_outwards(Scene(Mesh(walls.mesh.vertices, walls.mesh.faces[order]), walls.owner, walls.parts))
    assert looks(found) == looks(scene(box(WALL, 0.0, 2.7)))
    assert volume(found) == pytest.approx(4.0 * 0.2 * 2.7)


def test_only_what_is_wound_inwards_is_turned():
    outwards, inwards = scene(box(WALL, 0.0, 2.7)), box((6.0, 0.0, 9.0, 0.2), 0.0, 2.7)
    inwards.invert()
    found = turn_bodies_outwards(scene(box(WALL, 0.0, 2.7), inwards))
    assert volume(found) == pytest.approx(volume(outwards) + 3.0 * 0.2 * 2.7)


@pytest.mark.parametrize("twice", [False, True])
def test_a_shell_around_a_room_and_a_sheet_stay_as_they_are(twice):
    room = wound(scene(box((0.0, 0.0, 4.0, 3.0), 0.0, 2.7)), over=True, twice=twice)
    assert turn_bodies_outwards(room) is room
    alone = wound(scene(sheet((0.0, 0.0), (4.0, 0.0), 0.0, 2.7)), over=True, twice=twice)
    assert turn_bodies_outwards(alone) is alone


def test_parts_keep_their_faces():
    walls = wound(scene(box(WALL, 0.0, 2.7)), over=True, twice=True)
    owner = np.repeat(np.array([0, 1], np.int32), len(walls.mesh.faces) // 2)
    found = turn_bodies_outwards(Scene(walls.mesh, owner, (PartNames(("front",)), PartNames(("back",)))))
    assert len(found.owner) == len(found.mesh.faces) == 12
    assert len(found.parts) == 2


def test_the_faces_on_which_two_walls_touch_stay_as_they_are():
    walls = scene(box(WALL, 0.0, 2.7), box(BEHIND, 0.0, 2.7))
    assert turn_bodies_outwards(walls) is walls
