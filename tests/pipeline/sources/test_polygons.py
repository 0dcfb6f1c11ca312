import numpy as np
import pytest
import trimesh

from pipeline.sources.meshes.scene import triangulate_polygons

NOTCHED = np.array([(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (4, 0), (4, 3), (0, 3)], float)  # a wall with its door hole


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_notch_stays_open_and_the_winding_is_kept(axes, way):
    ring = np.column_stack([NOTCHED, np.zeros(8)])[::way][:, axes]
    faces, owner = triangulate_polygons(ring, np.arange(8), np.array([8]))
    mesh = trimesh.Trimesh(ring, faces, process=False)
    normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    assert mesh.area == pytest.approx(10.0)
    assert ((mesh.face_normals @ normal) > 0).all()
    assert set(owner) == {0}


def test_polygons_of_several_sizes_keep_their_order():
    ring = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    faces, owner = triangulate_polygons(ring, np.array([0, 1, 2, 0, 1, 2, 3, 1, 0]), np.array([3, 4, 2]))
    assert faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    assert owner.tolist() == [0, 1, 1]
