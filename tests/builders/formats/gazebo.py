"""A tiny Gazebo world: rooms of 4 x 3 m and 3 x 3 m side by side, a door between, with walls of 0.2 m as boxes."""

from __future__ import annotations

from pathlib import Path

Box = tuple[float, float, float, float, float, float]
"""x1, y1, z1, x2, y2, z2 in metres."""

WALLS: tuple[Box, ...] = (
    (-0.2, -0.2, 0.0, 7.4, 0.0, 2.5),
    (-0.2, 3.0, 0.0, 7.4, 3.2, 2.5),
    (-0.2, 0.0, 0.0, 0.0, 3.0, 2.5),
    (7.2, 0.0, 0.0, 7.4, 3.0, 2.5),
    (4.0, 0.0, 0.0, 4.2, 1.0, 2.5),
    (4.0, 1.9, 0.0, 4.2, 3.0, 2.5),
    (4.0, 1.0, 2.1, 4.2, 1.9, 2.5),
)
GROUND = (
    "<model name='ground'><static>1</static><link name='l'><visual name='v'><geometry>"
    "<plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></visual></link></model>"
)


def box(name: str, size: tuple[float, float, float], pose: str, tag: str = "visual") -> str:
    """Return a visual, or a collision, of a box about its pose."""
    sizes = " ".join(map(str, size))
    return f"<{tag} name='{name}'><pose>{pose}</pose><geometry><box><size>{sizes}</size></box></geometry></{tag}>"


def part(k: int, corners: Box, tag: str = "visual") -> str:
    """Return a box between two corners."""
    x1, y1, z1, x2, y2, z2 = corners
    pose = f"{(x1 + x2) / 2} {(y1 + y2) / 2} {(z1 + z2) / 2} 0 0 0"
    return box(f"v{k}", (x2 - x1, y2 - y1, z2 - z1), pose, tag)


def house(pose: str = "", inner: str = "") -> str:
    """Return the walls as a fixed model."""
    walls = "".join(part(k, wall) for k, wall in enumerate(WALLS))
    at = f"<pose>{pose}</pose>" if pose else ""
    return f"<model name='house'><static>true</static>{at}<link name='walls'>{walls}</link>{inner}</model>"


def cube(name: str, pose: str, size: float = 0.6, static: bool = True) -> str:
    """Return a model that is a cube."""
    link = f"<link name='l'>{box('v', (size, size, size), '0 0 0 0 0 0')}</link>"
    return f"<model name='{name}'><static>{int(static)}</static><pose>{pose}</pose>{link}</model>"


def world(*parts: str, version: str = "1.7") -> str:
    """Return a world with its ground."""
    return f"<sdf version='{version}'><world name='w'>{GROUND}{''.join(parts)}</world></sdf>"


def model(folder: Path, name: str, content: str) -> Path:
    """Write a model's folder."""
    (folder / name).mkdir(parents=True)
    (folder / name / "model.config").write_text("<model><sdf version='1.6'>model.sdf</sdf></model>")
    file = folder / name / "model.sdf"
    file.write_text(f"<sdf version='1.6'>{content}</sdf>")
    return file
