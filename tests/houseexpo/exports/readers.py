"""Shapes back from the files, without our code."""

from __future__ import annotations

import io
import json
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import reduce

import numpy as np
import pytest
import shapely
import trimesh
import yaml
from PIL import Image
from shapely.geometry.base import BaseGeometry

from houseexpo import FloorPlan

Reader = Callable[[Mapping[str, bytes]], BaseGeometry]


def near(plan: FloorPlan) -> object:
    """Return what an area equals that is the plan's to 1 %."""
    return pytest.approx(plan.area, rel=0.01)


def enclosed(walls: Iterable[BaseGeometry]) -> BaseGeometry:
    """What a set of walls closes in: everything inside their outer faces but themselves."""
    solid = shapely.union_all([wall.buffer(1e-4, join_style="mitre") for wall in walls])
    hull = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(solid)])
    return shapely.difference(hull, solid)


def solid_at(mesh: trimesh.Trimesh, height: float) -> list[BaseGeometry]:
    """What stands at a height of a y-up mesh, seen from above; a ray crosses its border an odd number of times."""
    segments = trimesh.intersections.mesh_plane(mesh, plane_normal=(0, 1, 0), plane_origin=(0, height, 0))
    lines = shapely.linestrings(np.stack([segments[..., 0], -segments[..., 2]], axis=-1))
    noded = shapely.union_all(lines, grid_size=1e-5)
    faces = shapely.get_parts(shapely.polygonize([noded]))
    points = shapely.get_coordinates(shapely.point_on_surface(faces))
    corners, line = shapely.get_coordinates(shapely.get_parts(noded), return_index=True)
    follows = line[1:] == line[:-1]
    (x1, y1), (x2, y2) = corners[:-1][follows].T, corners[1:][follows].T
    x, y = points.T[..., None]
    spans = (y1 > y) != (y2 > y)  # half open: a ray through a corner crosses one of its two sides
    to_the_right = (x2 - x1) * (y - y1) / np.where(y2 == y1, 1.0, y2 - y1) + x1 > x
    crossed = (spans & to_the_right).sum(axis=1)
    return [face for face, count in zip(faces, crossed, strict=True) if count % 2]


def parsed(text: bytes) -> ET.Element:
    """The root of an XML file that was just written."""
    return ET.fromstring(text)  # noqa: S314  # our own text


def box_of(part: ET.Element) -> tuple[BaseGeometry, float, float] | None:
    """Footprint, foot and top of a collision that is a box."""
    size = part.findtext("geometry/box/size")
    if size is None:
        return None
    x, y, z, roll, pitch, yaw = map(float, part.findtext("pose").split())
    assert (roll, pitch, yaw) == (0, 0, 0)
    wide, deep, high = map(float, size.split())
    shape = shapely.box(x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2)
    return shape, round(z - high / 2, 6), round(z + high / 2, 6)


def polyline_of(part: ET.Element) -> tuple[BaseGeometry, float, float]:
    """Footprint, foot and top of a collision that is an extruded polyline."""
    x, y, z, *_ = map(float, part.findtext("pose").split())
    assert (x, y) == (0, 0)
    points = [tuple(map(float, point.text.split())) for point in part.iter("point")]
    return shapely.Polygon(points), z, z + float(part.findtext("geometry/polyline/height"))


def stage_blocks(text: str) -> tuple[list[BaseGeometry], tuple[float, ...], tuple[float, ...]]:
    """Blocks, size and pose of the model of walls in a Stage world."""
    model = text[text.index("\nmodel\n") :]
    blocks = []
    for line in re.findall(r"block \((.*)\)", model):
        count = int(re.search(r"points (\d+)", line)[1])
        points = [tuple(map(float, p.split())) for p in re.findall(r"point\[\d+\] \[([^\]]*)\]", line)]
        assert len(points) == count
        blocks.append(shapely.Polygon(points))

    def numbers(key: str) -> tuple[float, ...]:
        return tuple(map(float, re.search(rf"  {key} \[([^\]]*)\]", model)[1].split()))

    return blocks, numbers("size"), numbers("pose")


def of_cells(free: np.ndarray, origin: tuple[float, float], yaw: float, cell_m: float) -> BaseGeometry:
    """Return the area of cells (rows, cols), row 0 at the lowest y, turned by a yaw about their lower-left corner."""
    rows, cols = np.nonzero(free)
    cells = shapely.union_all(shapely.box(cols, rows, cols + 1, rows + 1))
    cos, sin = math.cos(yaw) * cell_m, math.sin(yaw) * cell_m
    return shapely.affinity.affine_transform(cells, [cos, -sin, sin, cos, *origin])


def _ros(files: Mapping[str, bytes]) -> BaseGeometry:
    said = next(yaml.safe_load(data) for name, data in files.items() if name.endswith(".yaml"))
    pixels = np.asarray(Image.open(io.BytesIO(files[said["image"]])))
    x, y, yaw = said["origin"]
    return of_cells(pixels[::-1] == 254, (x, y), yaw, said["resolution"])


def _png(files: Mapping[str, bytes]) -> BaseGeometry:
    (image,) = (Image.open(io.BytesIO(data)) for data in files.values())
    x, y, yaw = json.loads(image.text["origin"])
    return of_cells(np.asarray(image)[::-1] == 255, (x, y), yaw, float(image.text["resolution"]))


def _npz(files: Mapping[str, bytes]) -> BaseGeometry:
    (data,) = (np.load(io.BytesIO(each)) for each in files.values())
    return of_cells(data["occupancy"] == 0, tuple(data["origin"]), float(data["yaw"]), float(data["resolution"]))


def _coco(files: Mapping[str, bytes]) -> BaseGeometry:
    said = json.loads(files["annotations.json"])
    (image,) = said["images"]
    rings = [np.reshape(ring, (-1, 2)) for each in said["annotations"] for ring in each["segmentation"]]
    names = {each["id"]: each["name"] for each in said["categories"]}
    kinds = [names[each["category_id"]] for each in said["annotations"] for _ in each["segmentation"]]
    inside = [ring for ring, kind in zip(rings, kinds, strict=True) if kind != "entrance"]
    flipped = [(ring * (1, -1) + (0, image["height"])) * image["resolution"] for ring in inside]
    cos, sin = math.cos(image["yaw"]), math.sin(image["yaw"])
    shape = shapely.union_all([shapely.Polygon(ring).buffer(0.006) for ring in flipped])  # shuts slits to pillars
    return shapely.affinity.affine_transform(shape.buffer(-0.006), [cos, -sin, sin, cos, *image["origin"]])


def _dxf(files: Mapping[str, bytes]) -> BaseGeometry:
    ezdxf = pytest.importorskip("ezdxf")
    (text,) = (data.decode() for data in files.values())
    space = ezdxf.read(io.StringIO(text)).modelspace()
    layers = {
        name: [
            shapely.Polygon([point[:2] for point in each.get_points()])
            for each in space.query("LWPOLYLINE")
            if each.dxf.layer in name.split()
        ]
        for name in ("ROOMS", "DOORS OPENINGS")
    }
    rooms = reduce(shapely.symmetric_difference, layers["ROOMS"])  # pillars are rings inside of rooms
    return shapely.union_all([shape.buffer(1e-3) for shape in (rooms, *layers["DOORS OPENINGS"])])


def _geojson(files: Mapping[str, bytes]) -> BaseGeometry:
    (found,) = (json.loads(data) for data in files.values())
    return next(
        shapely.geometry.shape(each["geometry"])
        for each in found["features"]
        if each["properties"]["kind"] == "free_space"
    )


def _mesh(kind: str) -> Reader:
    def read(files: Mapping[str, bytes]) -> BaseGeometry:
        (data,) = files.values()
        scene = trimesh.load(io.BytesIO(data), file_type=kind, force="scene", split_object=True, group_material=False)
        mesh = scene.to_mesh()
        return enclosed(solid_at(mesh, mesh.bounds[0, 1] + 0.55))

    return read


def _graphml(files: Mapping[str, bytes]) -> BaseGeometry:
    (root,) = (ET.fromstring(data) for data in files.values())  # noqa: S314 - our own text
    tag = "{http://graphml.graphdrawing.org/xmlns}"
    keys = {key.get("id"): key.get("attr.name") for key in root.iter(f"{tag}key")}
    nodes = [{keys[d.get("key")]: d.text for d in node.iter(f"{tag}data")} for node in root.iter(f"{tag}node")]
    return shapely.MultiPoint([(float(node["x"]), float(node["y"])) for node in nodes])


def _ifc(files: Mapping[str, bytes]) -> BaseGeometry:
    pytest.importorskip("ifcopenshell")
    import ifcopenshell.geom

    (text,) = (data.decode() for data in files.values())
    file = ifcopenshell.file.from_string(text)
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    areas = []
    for kind in ("IfcSpace", "IfcOpeningElement"):
        for each in file.by_type(kind):
            made = ifcopenshell.geom.create_shape(settings, each).geometry
            points, faces = np.reshape(made.verts, (-1, 3)), np.reshape(made.faces, (-1, 3))
            triangles = [shapely.Polygon(points[face, :2]) for face in faces]
            areas += [each.buffer(1e-6) for each in triangles if each.area > 1e-9]
    return shapely.union_all(areas)


def _irsim(files: Mapping[str, bytes]) -> BaseGeometry:
    (world,) = (yaml.safe_load(data) for data in files.values())
    return enclosed([shapely.Polygon(each["shape"]["vertices"]) for each in world["obstacle"]])


def _json(files: Mapping[str, bytes]) -> BaseGeometry:
    (found,) = (json.loads(data) for data in files.values())
    return shapely.Polygon(found["verts"])


def _mjcf(files: Mapping[str, bytes]) -> BaseGeometry:
    mujoco = pytest.importorskip("mujoco")
    (text,) = (data.decode() for data in files.values())
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    walls = []
    for number in range(model.ngeom):
        name, place = model.geom(number).name, data.geom_xpos[number]
        if not name.startswith(("wall", "furniture_stairwell")):
            continue
        turn = data.geom_xmat[number].reshape(3, 3)
        if model.geom_type[number] == mujoco.mjtGeom.mjGEOM_BOX:
            corners = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * model.geom_size[number]
        else:
            mesh = model.geom_dataid[number]
            start = model.mesh_vertadr[mesh]
            corners = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
        points = corners @ turn.T + place
        walls.append(shapely.MultiPoint(points[:, :2]).convex_hull)
    return enclosed(walls)


def _pol(files: Mapping[str, bytes]) -> BaseGeometry:
    (words,) = (data.split() for data in files.values())
    numbers = [float(Fraction(word.decode())) for word in words]
    rings, at = [], 0
    while at < len(numbers):
        count = int(numbers[at])
        rings.append(np.reshape(numbers[at + 1 : at + 1 + 2 * count], (-1, 2)))
        at += 1 + 2 * count + (len(rings) == 1)  # after the outline comes the number of holes
    return shapely.Polygon(rings[0], rings[1:])


def _rmf(files: Mapping[str, bytes]) -> BaseGeometry:
    said = next(yaml.safe_load(data) for name, data in files.items() if name.endswith(".building.yaml"))
    assert said["coordinate_system"] == "cartesian_meters"
    (level,) = said["levels"].values()
    points = np.array([vertex[:2] for vertex in level["vertices"]])
    floors, holes = ([shapely.Polygon(points[each["vertices"]]) for each in level[key]] for key in ("floors", "holes"))
    return shapely.difference(shapely.union_all([each.buffer(1e-3) for each in floors]), shapely.union_all(holes))


def _sdf(files: Mapping[str, bytes]) -> BaseGeometry:
    (root,) = (parsed(data) for data in files.values())
    walls = []
    for model in root.iter("model"):
        if model.get("name").startswith(("walls", "furniture", "entrance")):
            x, y, _, roll, pitch, yaw = map(float, model.findtext("pose", "0 0 0 0 0 0").split())
            assert (roll, pitch) == (0, 0)
            cos, sin = math.cos(yaw), math.sin(yaw)
            parts = [box_of(part) or polyline_of(part) for part in model.iter("collision")]
            low = [shape for shape, foot, _ in parts if foot < 1]
            walls += [shapely.affinity.affine_transform(shape, [cos, -sin, sin, cos, x, y]) for shape in low]
    return enclosed(walls)


def _stage(files: Mapping[str, bytes]) -> BaseGeometry:
    (text,) = (data.decode() for data in files.values())
    blocks, size, pose = stage_blocks(text)
    x1, y1, x2, y2 = shapely.total_bounds(blocks)
    assert (x2 - x1, y2 - y1) == pytest.approx(size[:2], abs=1e-3)
    assert ((x1 + x2) / 2, (y1 + y2) / 2, 0, 0) == pytest.approx(pose, abs=1e-3)
    return enclosed(blocks)


def _svg(files: Mapping[str, bytes]) -> BaseGeometry:
    (root,) = (parsed(data) for data in files.values())
    group = next(each for each in root if each.get("id") == "free-space")
    ((_, path),) = ((each.tag, each.get("d")) for each in group)
    rings = [
        np.array(re.findall(r"-?[\d.]+", part), float).reshape(-1, 2) * (1, -1) for part in path.split("Z") if part
    ]
    return shapely.Polygon(rings[0], rings[1:])


def _usd(files: Mapping[str, bytes]) -> BaseGeometry:
    pxr = pytest.importorskip("pxr.Usd")
    from pxr import Sdf, UsdGeom

    (text,) = (data.decode() for data in files.values())
    layer = Sdf.Layer.CreateAnonymous(".usda")
    assert layer.ImportFromString(text)
    stage = pxr.Stage.Open(layer)
    areas = []
    for prim in stage.Traverse():
        if prim.GetName().startswith("Floor") and prim.IsA(UsdGeom.Mesh):
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)
            matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
            moved = np.column_stack([points, np.ones(len(points))]) @ matrix[:, :3]
            faces = np.reshape(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get(), (-1, 3))
            triangles = [shapely.Polygon(moved[face, :2]) for face in faces]
            areas += [each.buffer(1e-6) for each in triangles if each.area > 1e-9]
    return shapely.union_all(areas)


READERS: dict[str, Reader] = {
    "coco": _coco, "dxf": _dxf, "geojson": _geojson, "glb": _mesh("glb"), "graphml": _graphml, "ifc": _ifc,
    "irsim": _irsim, "json": _json, "mjcf": _mjcf, "npz": _npz, "obj": _mesh("obj"), "png": _png, "pol": _pol,
    "rmf": _rmf, "ros": _ros, "sdf": _sdf, "stage": _stage, "svg": _svg, "usd": _usd,
}  # fmt: skip
"""The free space of a file, in the coordinates that the file has; of a graph, a point of each room."""
