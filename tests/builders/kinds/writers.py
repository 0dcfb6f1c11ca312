"""Parts into files as programs write them: PLY, STL and OFF as one mesh; OBJ, GLB and DAE with names and materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from tests.builders.kinds.parts.solids3d import joined
from tests.builders.kinds.placing import Placing
from tests.builders.kinds.values import Part

UP_OF = {".ply": "z", ".stl": "z", ".off": "z", ".obj": "y", ".glb": "y", ".dae": "z"}
"""The up axis that a format's files mostly have."""


def write(parts: Sequence[Part], path: Path, placing: Placing) -> Path:
    """Write parts into a file of the path's suffix."""
    suffix = path.suffix
    if suffix == ".glb":
        _glb(parts, path, placing)
    elif suffix == ".obj":
        _obj(parts, path, placing)
    elif suffix == ".dae":
        _dae(parts, path, placing)
    else:
        placing.mesh_in_file(joined(p.mesh for p in parts)).export(path)
    return path


def colour(material: str) -> list[int]:
    """A material's colour, the same for the same name."""
    code = sum(ord(c) * (k + 7) for k, c in enumerate(material))
    return [60 + code * 37 % 180, 60 + code * 59 % 180, 60 + code * 83 % 180, 255]


def _glb(parts: Sequence[Part], path: Path, placing: Placing) -> None:
    """Every third file has its parts z-up, or in centimetres, under a root that turns and scales them."""
    scene, root = trimesh.Scene(), None
    inner, turn = placing, np.eye(4)
    if placing.up == "y" and len(parts) % 3 == 0:
        factor = 0.01 if len(parts) % 2 else 1.0
        inner = replace(placing, up="z", unit_m=placing.unit_m * factor)
        turn = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)) @ np.diag([factor, factor, factor, 1.0])
        root = "RootNode"
        scene.graph.update(frame_from=scene.graph.base_frame, frame_to=root, matrix=turn)
    materials = {p.material: PBRMaterial(name=p.material, baseColorFactor=colour(p.material)) for p in parts}
    for number, part in enumerate(parts):
        placed = inner.mesh_in_file(part.mesh)
        # Half of the nodes stand where they are by a transform of their own, as artists' files have it.
        at = placed.bounds.mean(axis=0) if number % 2 else np.zeros(3)
        local = trimesh.Trimesh(placed.vertices - at, placed.faces, process=False)
        local.visual = trimesh.visual.TextureVisuals(material=materials[part.material])
        name = part.name or f"mesh_{number}"
        unique = name if name not in scene.graph.nodes else f"{name}.{number:03d}"
        move = trimesh.transformations.translation_matrix(at)
        scene.add_geometry(local, node_name=unique, geom_name=unique, parent_node_name=root, transform=move)
    path.write_bytes(scene.export(file_type="glb"))


def _obj(parts: Sequence[Part], path: Path, placing: Placing) -> None:
    lines, start = [f"mtllib {path.stem}.mtl"], 1
    for number, part in enumerate(parts):
        placed = placing.mesh_in_file(part.mesh)
        lines.append(f"{'o' if number % 3 else 'g'} {part.name or f'object_{number}'}".replace("  ", "_"))
        lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in placed.vertices]
        lines.append(f"usemtl {part.material or 'default'}".replace(" ", "_").replace("usemtl_", "usemtl "))
        lines += [f"f {a} {b} {c}" for a, b, c in np.asarray(placed.faces) + start]
        start += len(placed.vertices)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    names = sorted({(p.material or "default").replace(" ", "_") for p in parts})
    shades = [f"newmtl {n}\nKd " + " ".join(f"{c / 255:.3f}" for c in colour(n)[:3]) for n in names]
    path.with_suffix(".mtl").write_text("\n".join(shades) + "\n", encoding="utf-8")


def _dae(parts: Sequence[Part], path: Path, placing: Placing) -> None:
    geometries, nodes = [], []
    for number, part in enumerate(parts):
        placed = placing.mesh_in_file(part.mesh)
        points = " ".join(f"{v:.5f}" for v in placed.vertices.ravel())
        corners = " ".join(str(v) for v in placed.faces.ravel())
        name, count, faces = quoteattr(part.name or f"g{number}"), len(placed.vertices), len(placed.faces)
        geometries.append(
            f'<geometry id="g{number}" name={name}><mesh><source id="g{number}p"><float_array id="g{number}a" '
            f'count="{3 * count}">{points}</float_array><technique_common>'
            f'<accessor source="#g{number}a" count="{count}" '
            f'stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
            f'</accessor></technique_common></source><vertices id="g{number}v">'
            f'<input semantic="POSITION" '
            f'source="#g{number}p"/></vertices><triangles count="{faces}">'
            f'<input semantic="VERTEX" source="#g{number}v" '
            f'offset="0"/><p>{corners}</p></triangles></mesh></geometry>'
        )
        nodes.append(f'<node id="n{number}" name={name} type="NODE"><instance_geometry url="#g{number}"/></node>')
    names = {1.0: "meter", 0.01: "centimeter", 0.001: "millimeter", 0.0254: "inch", 0.3048: "foot"}
    unit = f'<unit name="{names.get(placing.unit_m, "unit")}" meter="{placing.unit_m:g}"/>'
    path.write_text(
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>'
        f"{unit}<up_axis>{placing.up.upper()}_UP</up_axis></asset><library_geometries>{''.join(geometries)}"
        f'</library_geometries><library_visual_scenes><visual_scene id="scene">{"".join(nodes)}</visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>\n',
        encoding="utf-8",
    )
