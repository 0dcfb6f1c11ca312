"""A scanned flat as points: rooms of 4 x 3 m and 3 x 3 m, a wall of 0.2 m with a door between, a window, a cupboard."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]
Patch = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""A rectangle: a corner and its two sides."""

TOP = 2.5


def flat() -> list[Patch]:
    """Return the surfaces that are seen from inside; the outer faces are not."""
    found: list[Patch] = []
    for x1, x2 in ((0.0, 4.0), (4.2, 7.2)):
        found += [((x1, 0, z), (x2 - x1, 0, 0), (0, 3, 0)) for z in (0.0, TOP)]
        found.append(((x1, 0, 0), (x2 - x1, 0, 0), (0, 0, TOP)))
    found += [((0, 0, 0), (0, 3, 0), (0, 0, TOP)), ((7.2, 0, 0), (0, 3, 0), (0, 0, TOP))]
    found.append(((4.2, 3, 0), (3, 0, 0), (0, 0, TOP)))
    found += [  # a window in the long wall
        ((0, 3, 0), (4, 0, 0), (0, 0, 0.9)),
        ((0, 3, 2.1), (4, 0, 0), (0, 0, 0.4)),
        ((0, 3, 0.9), (1, 0, 0), (0, 0, 1.2)),
        ((2, 3, 0.9), (2, 0, 0), (0, 0, 1.2)),
    ]
    for x in (4.0, 4.2):  # both faces of the wall between, with a door from y = 1 to 1.9
        found += [
            ((x, 0, 0), (0, 1, 0), (0, 0, TOP)),
            ((x, 1.9, 0), (0, 1.1, 0), (0, 0, TOP)),
            ((x, 1, 2.1), (0, 0.9, 0), (0, 0, 0.4)),
        ]
    found += [((4, y, 0), (0.2, 0, 0), (0, 0, 2.1)) for y in (1.0, 1.9)]
    found += [((4, 1, z), (0.2, 0, 0), (0, 0.9, 0)) for z in (0.0, 2.1)]
    found += [((1, 1, 0), (1.2, 0, 0), (0, 0, 1.0)), ((1, 1, 0), (0, 0.5, 0), (0, 0, 1.0))]  # a cupboard
    found += [((1, 1.5, 0), (1.2, 0, 0), (0, 0, 1.0)), ((2.2, 1, 0), (0, 0.5, 0), (0, 0, 1.0))]
    return [*found, ((1, 1, 1.0), (1.2, 0, 0), (0, 0.5, 0))]


def sampled(
    patches: Sequence[Patch],
    rng: np.random.Generator,
    density: float = 3000.0,
    noise_m: float = 0.0,
    outliers: float = 0.0,
) -> Points:
    """Return points (n, 3) on rectangles, ``density`` a square metre, and a share of them thrown anywhere."""
    found = []
    for corner, a, b in patches:
        count = int(density * np.linalg.norm(np.cross(a, b)))
        u, v = rng.random((2, count, 1))
        found.append(np.array(corner) + u * np.array(a) + v * np.array(b))
    points = np.concatenate(found)
    points += rng.normal(0.0, noise_m, points.shape) if noise_m else 0.0
    low, high = points.min(axis=0) - 0.3, points.max(axis=0) + 0.3
    wild = rng.random(len(points)) < outliers
    points[wild] = low + rng.random((int(wild.sum()), 3)) * (high - low)
    return points


def turned(points: Points, degrees: float, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Points:
    """Return points turned about the upright axis and shifted."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + shift


def write_ply(path: Path, points: Points, ascii_: bool = False) -> Path:
    """Write a PLY without faces."""
    kind = "ascii" if ascii_ else "binary_little_endian"
    properties = "".join(f"property float {axis}\n" for axis in "xyz") + "property uchar red\n"
    head = f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\n{properties}end_header\n".encode()
    if ascii_:
        body = "".join(f"{x:.4f} {y:.4f} {z:.4f} 7\n" for x, y, z in points).encode()
    else:
        rows = np.zeros(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1")])
        for axis, column in zip("xyz", points.T, strict=True):
            rows[axis] = column
        body = rows.tobytes()
    path.write_bytes(head + body)
    return path


def write_pcd(path: Path, points: Points, ascii_: bool = False) -> Path:
    """Write a PCD with a column before the coordinates."""
    count, data = len(points), "ascii" if ascii_ else "binary"
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS i x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 2 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n"
    ).encode()
    if ascii_:
        body = "".join(f"1 2 {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in points).encode()
    else:
        rows = np.zeros(count, [("i", "<u4", (2,)), ("xyz", "<f4", (3,))])
        rows["xyz"] = points
        body = rows.tobytes()
    path.write_bytes(head + body)
    return path


def write_packed_pcd(path: Path, points: Points) -> Path:
    """Write a compressed PCD: LZF of literal runs, and of one copy for each colour after the first."""
    count, grey = len(points), b"\x07\x08\x09\x0a"
    head = (
        "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA binary_compressed\n"
    ).encode()
    plain = points.T.astype("<f4").tobytes() + grey
    packed = b"".join(bytes([len(plain[k : k + 32]) - 1]) + plain[k : k + 32] for k in range(0, len(plain), 32))
    left = 4 * (count - 1)  # copies of the colour, 4 bytes back, of 264 bytes at most
    for length in [264] * (left // 264) + [left % 264]:
        packed += bytes([0xE0, length - 9, 3]) if length > 8 else bytes([(length - 2) << 5, 3])
    path.write_bytes(head + np.array([len(packed), 16 * count], "<u4").tobytes() + packed)
    return path


def write_xyz(path: Path, points: Points, divider: str = " ") -> Path:
    """Write lines of numbers, with a comment and a colour."""
    rows = [divider.join([f"{x:.4f}", f"{y:.4f}", f"{z:.4f}", "255"]) for x, y, z in points]
    path.write_text("# x y z\n" + "\n".join(rows) + "\n")
    return path


def write_las(path: Path, points: Points) -> Path:
    """Write LAS, or LAZ by the suffix."""
    import laspy

    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales = np.full(3, 0.001)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points.T
    cloud.write(path)
    return path


def write_e57(path: Path, points: Points) -> Path:
    """Write E57 as one scan."""
    import pye57

    file = pye57.E57(str(path), mode="w")
    file.write_scan_raw({f"cartesian{axis}": column.copy() for axis, column in zip("XYZ", points.T, strict=True)})
    file.close()
    return path
