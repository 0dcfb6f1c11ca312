"""Read a robot's map from files of map_server, a picture, an array, a ROS 2 bag or a Stage world, as occupancy cells.

Formats: map_server's ``map.yaml`` with its picture (ROS 1 and Nav2), a picture alone (.pgm, .png and others), a NumPy
array (.npy), the ``nav_msgs/OccupancyGrid`` of a ROS 2 bag (.mcap, .db3, or the folder of a bag), and the bitmap of a
world of Stage's (.world, see ``stage_world``).

R1  A picture's colours are averaged, and transparent pixels are unknown. ``negate`` swaps black and white.
R2  Darkness is 0 for white and 1 for black. In the modes ``trinary`` and ``scale``, a cell darker than
    ``occupied_thresh`` is occupied, and one lighter than ``free_thresh`` is free. In between, it is unknown
    (``trinary``), or its occupancy grows linearly from 0 to 100 (``scale``).
    In a trinary picture of map_saver's, 205 (darkness 0.196) is unknown, whatever ``free_thresh`` is: map_saver writes
    205 for unknown cells, but the ``free_thresh`` of 0.25 that Nav2 wrote beside such pictures until 2025 would make
    them free. A picture is map_saver's if it has white and most of its grey cells are 205; the other grey cells come
    from people who draw and erase. A turned or scaled picture has more shades beside all edges: it is map_saver's if
    205 is ``TURNED_SHARE`` of its grey cells and its border is 205.
R3  In the mode ``raw``, a pixel's value is the occupancy, from 0 to 100; other values are unknown.
R4  Without a ``map.yaml``, a cell is free if it is lighter than ``FREE_SHARE`` of the way from unknown space to white.
    The shade of unknown space is the lightest of the shades that each have at least ``SHADE_SHARE`` of the grey cells.
    Other greys come from cells that few rays passed, or from scaling. A cell lighter than unknown space that is not
    free is likely free: its occupancy is between ``FREE_TO`` and ``EVEN``.
R5  The picture lies in the folder of its ``map.yaml``. Where the file names another folder, the picture of this name
    beside the ``map.yaml`` is taken.
R9  An origin whose yaw is not a number (map_saver writes ``-nan`` where the map's turn was never set) has a yaw of 0.
    A yaw of more than a full turn counts as radians, too. Both are noted.
R6  An array of bool is True for occupied cells. Floats are the probability of occupied, 0 to 1, NaN for unknown.
    Integers are the occupancy, 0 to 100; other values are unknown. Row 0 is at the highest y, as in a picture.
R7  The map of a bag is the last message of the topic ``/map``. Without this topic, it comes from the only topic with
    maps; of several topics, from the one whose name ends with ``map`` and contains no ``costmap``.
R8  The key ``walls_only`` of a ``map.yaml``, which map_server ignores, and a PNG's text of this name mean that every
    cell that is not free is wall: the map is a drawn plan without furniture and noise. Our exports of plans write it.
    Such a PNG's texts ``resolution`` and ``origin`` are those of a ``map.yaml``; a resolution that is given stands
    above the text.
"""

from __future__ import annotations

import logging
import math
import os
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from houseexpo.errors import HouseExpoError, MissingDependencyError, install_command
from houseexpo.file_kinds import HEAD_BYTES, PICTURES, format_suffix
from houseexpo.files import decode_yaml, is_device, real_path
from houseexpo.grids.stage_world import FREE_FROM, WorldError, is_stage_world, read_floor_model
from houseexpo.tolerances import SAME_PX

_log = logging.getLogger(__name__)

UNKNOWN: Final = -1
GRID_TYPE: Final = "nav_msgs/msg/OccupancyGrid"
MAX_MAP_CELLS: Final = 100_000_000
LARGEST_CELL_M: Final = 10.0
SMALLEST_CELL_M: Final = 1e-4
OCCUPIED_FROM, FREE_TO = 65, 25
"""Occupancy, in percent, from which a cell counts as occupied and up to which as free (Nav2's defaults)."""
EVEN: Final = 50
"""Below this occupancy, a cell is more likely free than occupied."""
OCCUPIED_THRESH: Final = 0.65
FREE_THRESH: Final = 0.25
WHITE: Final = 0.02
"""A shade within this share of 255 from 0 or 255 is black or white; also the least ``free_thresh`` (R4)."""
SHADE_SHARE: Final = 0.05
FREE_SHARE: Final = 0.3
"""R4: in a scaled picture, single rays are only a little lighter than unknown space."""
SAVED_UNKNOWN: Final = 205
"""The shade that map_saver writes for unknown cells, beside 0 and 254."""
SAVED_SHARE: Final = 0.75
"""R2: the least share of unknown cells among the grey cells of map_saver's pictures."""
TURNED_SHARE: Final = 0.5
TURNED_BORDER: Final = 0.9
"""R2: in turned pictures of map_saver's, the least shares of unknown cells among grey cells and on the border."""
BAGS: Final = (".mcap", ".db3")
YAMLS: Final = (".yaml", ".yml")
WORLD: Final = ".world"
YAML_BYTES: Final = 1 << 20
STRETCHED: Final = 0.005
"""Cells of a world's bitmap count as square if their sides differ by less than this share."""
_DEEPEST: Final = 20
WALLS_ONLY: Final = "walls_only"
_NO_ORIGIN: Final = (0.0, 0.0, 0.0)
"""The key of R8."""

Occupancy = npt.NDArray[np.int8]
Bools = npt.NDArray[np.bool_]
Fault = Literal["missing_file", "unreadable", "too_large", "bad_units", "empty"]


class MapError(HouseExpoError):
    """A robot's map cannot be read; ``fault`` is the kind of fault, ``problem`` and ``advice`` are for people."""

    def __init__(self, problem: str, advice: str = "", fault: Fault = "unreadable") -> None:
        super().__init__(problem, advice, fault)
        self.problem, self.advice, self.fault = problem, advice, fault

    def __str__(self) -> str:
        return f"{self.problem}; {self.advice}" if self.advice else self.problem


@dataclass(frozen=True, eq=False)
class RobotMap:
    """Occupancy cells of a place.

    Parameters
    ----------
    occupancy
        (rows, cols) int8, row 0 at the highest y: 0 (free) to 100 (occupied), -1 for unknown.
    resolution_m
        The side of a cell, metres.
    origin
        (x, y, yaw) of the lower-left corner of the lower-left cell in the map's frame: metres and radians. ``yaw``
        turns the grid counter-clockwise about this corner.
    name
        The name of the map, for messages.
    unknown_shade
        The shade of the picture that is unknown although its thresholds make it free (R2), or None.
    walls_only
        Whether the file says that all cells that are not free are walls, without furniture and noise (R8).
    yaw_note
        A note if the file's yaw is unusual (R9), else "".

    Raises
    ------
    MapError
        There are no cells or too many, or a number is not finite or out of range.
    """

    occupancy: Occupancy
    resolution_m: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    name: str = "map"
    unknown_shade: int | None = None
    walls_only: bool = False
    yaw_note: str = ""

    def __post_init__(self) -> None:
        if self.occupancy.ndim != 2 or not self.occupancy.size:
            raise MapError(f"{self.name}: expected rows and columns of cells, found an array {self.occupancy.shape}")
        _check_size(self.occupancy.shape, self.name)
        if not SMALLEST_CELL_M <= self.resolution_m <= LARGEST_CELL_M:  # also refuses NaN
            raise MapError(
                f"{self.name}: resolution: expected {SMALLEST_CELL_M:g} to {LARGEST_CELL_M:g} m a cell, found "
                f"{self.resolution_m:g}",
                "correct it",
                "bad_units",
            )
        if not all(map(math.isfinite, self.origin)):
            raise MapError(
                f"{self.name}: origin: expected x, y and yaw, found {self.origin}", "correct it", "bad_units"
            )

    @property
    def free(self) -> Bools:
        """(rows, cols): whether a cell is free."""
        return np.asarray(self.occupancy.view(np.uint8) <= FREE_TO)  # as uint8, negative values are large

    @property
    def occupied(self) -> Bools:
        """(rows, cols): whether a cell is occupied."""
        return self.occupancy >= OCCUPIED_FROM

    def trimmed(self, margin_m: float = 1.0) -> RobotMap:
        """Return the map without unknown rows and columns around it, except for a margin, metres.

        The origin moves with the lower-left corner, so points keep their places in the map's frame.
        """
        margin = math.ceil(margin_m / self.resolution_m)
        known = self.occupancy >= 0
        spans = []
        for axis in (1, 0):
            at = np.flatnonzero(known.any(axis=axis))
            if not len(at):
                return self
            spans.append((max(int(at[0]) - margin, 0), int(at[-1]) + 1 + margin))
        (top, bottom), (left, right) = spans
        cut = self.occupancy[top:bottom, left:right]
        if cut.shape == self.occupancy.shape:
            return self
        ((x, y),) = self.points_from_pixels((left, top + cut.shape[0])).tolist()
        return replace(self, occupancy=np.ascontiguousarray(cut), origin=(x, y, self.origin[2]))

    def upright(self) -> RobotMap:
        """Return the map with cells along the axes of its frame: with a yaw of 0, in the same frame.

        A cell has the occupancy of the cell in which its middle lies. It is occupied if it touches an occupied cell, so
        that no thin wall opens. Cells beyond the picture are unknown.
        """
        x, y, yaw = self.origin
        if abs(math.remainder(yaw, math.tau)) * max(self.occupancy.shape) < SAME_PX:
            return self
        rows, cols = self.occupancy.shape
        corners = self.points_from_pixels([(0, 0), (cols, 0), (0, rows), (cols, rows)])
        low, high = corners.min(axis=0), corners.max(axis=0)
        wide, deep = (math.ceil(length / self.resolution_m - SAME_PX) for length in high - low)
        _check_size((deep, wide), self.name)
        cos, sin = math.cos(yaw), math.sin(yaw)
        found = np.full((deep, wide), UNKNOWN, np.int8)
        occupied = np.zeros((deep, wide), bool)
        for across, up in ((0.0, 0.0), *((i / 3, j / 3) for i in (-1, 0, 1) for j in (-1, 0, 1))):
            right = (np.arange(wide) + 0.5 + across)[None] * self.resolution_m + (low[0] - x)
            above = (np.arange(deep)[::-1] + 0.5 + up)[:, None] * self.resolution_m + (low[1] - y)
            col = np.floor((cos * right + sin * above) / self.resolution_m).astype(np.int64)
            row = rows - 1 - np.floor((cos * above - sin * right) / self.resolution_m).astype(np.int64)
            inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
            if (across, up) == (0.0, 0.0):
                found[inside] = self.occupancy[row[inside], col[inside]]
            occupied[inside] |= self.occupancy[row[inside], col[inside]] >= OCCUPIED_FROM
        found[occupied] = 100
        return replace(self, occupancy=found, origin=(float(low[0]), float(low[1]), 0.0))

    def points_from_pixels(self, pixels: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return points (n, 2) in the map's frame, metres, of points (across, down) from the picture's top left corner.

        Points are in cells; the middle of cell (row, col) is (col + 0.5, row + 0.5).
        """
        (a, b, c), (d, e, f) = self.affine
        across, down = np.asarray(pixels, np.float64).reshape(-1, 2).T * self.resolution_m
        up = self.occupancy.shape[0] * self.resolution_m - down
        return np.column_stack([a * across + b * up + c, d * across + e * up + f])

    @property
    def affine(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The map's frame from metres (right, up) from the lower-left corner: rows (a, b, x) and (d, e, y)."""
        x, y, yaw = self.origin
        cos, sin = math.cos(yaw), math.sin(yaw)
        return (cos, -sin, x), (sin, cos, y)


def read_map(
    path: str | os.PathLike[str],
    resolution: float | None = None,
    *,
    topic: str | None = None,
    negate: bool = False,
    occupied_thresh: float = OCCUPIED_THRESH,
    free_thresh: float | None = None,
) -> RobotMap:
    """Read a robot's map: a ``map.yaml``, a picture, an array, a bag or Stage's world (see the module's rules).

    Parameters
    ----------
    path
        The file, or the folder of a bag.
    resolution
        The side of a cell, metres, for a picture or an array alone. Other files state it.
    topic
        The topic of a bag (R7).
    negate, occupied_thresh, free_thresh
        The rules for a picture alone (R1, R2, R4).

    Raises
    ------
    MapError
        The file is missing, damaged or too large, names a missing picture or an invalid resolution, or no cell of the
        map is free.
    MissingDependencyError
        The file is a bag, and rosbags is not installed.
    """
    shading = _Shading(negate=negate, occupied=occupied_thresh, free=free_thresh)
    found = _read(Path(path), resolution, topic, shading)
    if not found.free.any():
        advice = "check the thresholds, and whether black and white are swapped (negate)"
        raise MapError(f"{found.name}: expected free space, found no free cell", advice, "empty")
    return found


def _read(file: Path, resolution: float | None, topic: str | None, shading: _Shading) -> RobotMap:
    suffix = format_suffix(file)
    if suffix in BAGS or is_bag_folder(file):
        return _from_bag(file, topic)
    if not file.is_file():
        raise MapError(f"{file}: there is no such file", "check the path", "missing_file")
    if suffix in YAMLS:
        return _from_yaml(file)
    if suffix == WORLD:
        return _from_world(file)
    picture = None if suffix == ".npy" else _grey_of(file)
    if resolution is None and picture is not None:
        resolution = picture.resolution
    if resolution is None:
        told = next((each for each in map(file.with_suffix, YAMLS) if each.is_file()), None)
        beside = "" if told is None else f" (name {told.name}, which lies beside it, if that is its map)"
        found = f"{file.name}: expected the side of a cell, found none{beside}"
        raise MapError(found, "give the resolution", "bad_units")
    size = _number(resolution, "resolution", file.name)
    if picture is None:
        return RobotMap(_from_array(file), size, name=file.name)
    cells, unknown_shade = shading.occupancy(picture, file.name)
    return RobotMap(cells, size, picture.origin, file.name, unknown_shade, picture.walls_only)


def is_map_yaml(head: bytes) -> bool:
    """Whether the first bytes of a YAML file are those of a ``map.yaml``."""
    text = head.removeprefix(b"\xef\xbb\xbf")  # a byte order mark, as editors under Windows write
    lines = {line.split(b":")[0].strip() for line in text.split(b"\n") if not line.startswith((b" ", b"\t", b"#"))}
    return {b"image", b"resolution"} <= lines


def is_map_file(path: Path) -> bool:
    """Whether a file may be a map by itself: a ``map.yaml``, a picture, an array or Stage's world."""
    suffix = format_suffix(path)
    if suffix in (*YAMLS, WORLD):
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        return is_stage_world(head) if suffix == WORLD else is_map_yaml(head)
    return suffix in (*PICTURES, ".npy")


def drop_map_pictures(files: Iterable[Path]) -> list[Path]:
    """Return map files without the pictures that belong to a ``map.yaml`` or a world among them (R5)."""
    every = list(files)
    taken = {map_picture_path(file) for file in every if file.suffix.lower() in (*YAMLS, WORLD)}
    return [file for file in every if real_path(file) not in taken]


def is_bag_folder(path: Path) -> bool:
    """Whether a path is the folder of a ROS 2 bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def map_picture_path(path: Path) -> Path | None:
    """Return the picture of a ``map.yaml`` or a world (R5), or None if it names no existing picture."""
    try:
        is_world = path.suffix.lower() == WORLD
        return _picture(path, read_floor_model(path).bitmap if is_world else _document(path).get("image"))
    except (MapError, WorldError, OSError):
        return None


@dataclass(frozen=True, eq=False)
class _Picture:
    """The mean of a picture's colours (rows, cols), 0 to 255, and where it is transparent; R8."""

    grey: npt.NDArray[np.uint8]
    clear: Bools | None = None
    walls_only: bool = False
    resolution: float | None = None
    origin: tuple[float, float, float] = _NO_ORIGIN


@dataclass(frozen=True)
class _Shading:
    """How pixels become occupancy."""

    negate: bool = False
    occupied: float = OCCUPIED_THRESH
    free: float | None = FREE_THRESH
    mode: str = "trinary"

    def occupancy(self, picture: _Picture, name: str) -> tuple[Occupancy, int | None]:
        """Return the occupancy of a picture, and the shade that is unknown although the thresholds make it free."""
        grey = picture.grey
        unknown = _unknown_darkness(grey, negate=self.negate) if self.free is None else None
        free = min(_free_thresh(unknown), self.occupied) if self.free is None else self.free
        if not (0.0 <= free <= self.occupied <= 1.0):
            found = f"free_thresh {free:g} and occupied_thresh {self.occupied:g}"
            raise MapError(
                f"{name}: expected thresholds from 0 to 1, free not above occupied, found {found}", "correct it"
            )
        shades = np.arange(256)
        value = np.full(256, UNKNOWN, np.int8)
        if self.mode == "raw":  # R3
            raw = 255 - shades if self.negate else shades
            value[raw <= 100] = raw[raw <= 100]
        else:
            dark = shades / 255 if self.negate else (255 - shades) / 255
            span = max(self.occupied - free, 1e-9)
            between = np.rint(np.clip((dark - free) / span, 0, 1) * 98 + 1)
            value[:] = between if self.mode == "scale" else UNKNOWN
            if unknown is not None:  # R4
                likely = (dark >= free) & (dark < unknown)
                share = (dark[likely] - free) / (unknown - free)
                value[likely] = FREE_TO + 1 + np.floor(share * (EVEN - FREE_TO - 1))
            value[dark < free] = 0
            value[dark > self.occupied] = 100
        unknown_shade = None
        if self.mode == "trinary" and not self.negate and value[SAVED_UNKNOWN] == 0 and _is_saved(grey):  # R2
            value[SAVED_UNKNOWN], unknown_shade = UNKNOWN, SAVED_UNKNOWN
        cells: Occupancy = value[grey]
        if picture.clear is not None:
            cells[picture.clear] = UNKNOWN
        return cells, unknown_shade


def _unknown_darkness(grey: npt.NDArray[np.uint8], *, negate: bool) -> float | None:
    """Return the darkness, 0 to 1, of unknown space in a picture alone (R4), or None if it has no unknown space."""
    counts = np.bincount(grey.ravel(), minlength=256)[:: -1 if negate else 1]
    margin = int(255 * WHITE)
    between = counts[margin + 1 : 255 - margin]
    common = np.flatnonzero((between >= SHADE_SHARE * between.sum()) & (between > 0))
    return (255 - margin - 1 - int(common[-1])) / 255 if len(common) else None


def _free_thresh(unknown: float | None) -> float:
    """Return the ``free_thresh`` of a picture alone, given the darkness of its unknown space (R4)."""
    return WHITE if unknown is None else max(unknown * (1 - FREE_SHARE), WHITE)


def _is_saved(grey: npt.NDArray[np.uint8]) -> bool:
    """Whether a picture is map_saver's; R2."""
    border = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
    is_turned = float((border == SAVED_UNKNOWN).mean()) >= TURNED_BORDER
    return _unknown_grey(grey, TURNED_SHARE if is_turned else SAVED_SHARE) == SAVED_UNKNOWN


def _unknown_grey(grey: npt.NDArray[np.uint8], share: float) -> int | None:
    """Return the shade of at least ``share`` of the grey cells in a picture with white, or None."""
    counts = np.bincount(grey.ravel(), minlength=256)
    margin = int(255 * WHITE)
    between = counts[margin + 1 : 255 - margin]
    if not counts[255 - margin :].any() or not between.any() or between.max() < share * between.sum():
        return None
    return int(between.argmax()) + margin + 1


def _from_yaml(file: Path) -> RobotMap:
    document = _document(file)
    missing = [key for key in ("image", "resolution") if key not in document]
    if missing:
        raise MapError(f"{file.name}: expected the keys image and resolution, found no {missing[0]}", "add it")
    picture = _picture_in_folder(file, document["image"], "image")
    mode = str(document.get("mode", "trinary")).lower()
    if mode not in {"trinary", "scale", "raw"}:
        raise MapError(f"{file.name}: mode: expected trinary, scale or raw, found {mode[:40]!r}", "correct it")
    occupied = _number(document.get("occupied_thresh", OCCUPIED_THRESH), "occupied_thresh", file.name)
    free = document.get("free_thresh", min(FREE_THRESH, occupied))
    negate = _flag(document.get("negate", 0), file.name, "negate")
    walls_only = _flag(document.get(WALLS_ONLY, 0), file.name, WALLS_ONLY)
    shading = _Shading(negate, occupied, _number(free, "free_thresh", file.name), mode)
    resolution = _number(document["resolution"], "resolution", file.name)
    origin, yaw_note = _origin(document.get("origin", [0.0, 0.0, 0.0]), file.name)
    cells, unknown_shade = shading.occupancy(_grey_of(picture), picture.name)
    return RobotMap(cells, resolution, origin, file.name, unknown_shade, walls_only, yaw_note)


def _document(file: Path) -> Mapping[str, Any]:
    if file.stat().st_size > YAML_BYTES:
        raise MapError(f"{file.name} has {file.stat().st_size:,} bytes, which no map.yaml has", fault="too_large")
    try:
        document = decode_yaml(file.read_bytes(), _DEEPEST)
    except ValueError as error:
        raise MapError(f"{file.name} {error}", "save the map again, or correct the file") from None
    if not isinstance(document, Mapping):
        raise MapError(f"{file.name}: expected a mapping with image and resolution", "save the map again")
    return document


def _from_world(file: Path) -> RobotMap:
    """Return the map of Stage's world; the rules are those of ``stage_world``."""
    try:
        floor = read_floor_model(file)
    except WorldError as error:
        advice = "give the map that its floor plan was made of, or correct it"
        raise MapError(str(error), advice, "empty" if "bitmap" in str(error) else "unreadable") from None
    picture = _picture_in_folder(file, floor.bitmap, "bitmap")
    grey = _grey_of(picture).grey
    place = _place_of_floor(grey >= FREE_FROM, boundary=floor.boundary)
    cells = np.where(grey >= FREE_FROM, 0, 100).astype(np.int8)
    unknown_shade = _unknown_grey(grey, SAVED_SHARE)
    if unknown_shade is not None:
        cells[grey == unknown_shade] = UNKNOWN  # R2, for any shade, since people scale bitmaps; in Stage, it is free
    (left, top), (right, bottom) = place
    wide, high = floor.size_m[0] / (right - left), floor.size_m[1] / (bottom - top)
    x, y, degrees = floor.pose
    yaw = math.radians(degrees)
    cos, sin = math.cos(yaw), math.sin(yaw)
    across, up = (left + right) / 2 * wide, (len(grey) - (top + bottom) / 2) * high
    side = min(wide, high)
    if max(wide, high) > (1 + STRETCHED) * side:  # the cells of a map are square
        cells = cells[_repeat(cells.shape[0], high / side)][:, _repeat(cells.shape[1], wide / side)]
    origin = x - cos * across + sin * up, y - sin * across - cos * up, yaw
    return RobotMap(cells, float(side), origin, file.name, unknown_shade)


def _place_of_floor(free: Bools, *, boundary: bool) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first (across, down) of the cells that Stage stretches to a model's size, and the end of the last."""
    rows, cols = np.flatnonzero(~free.all(axis=1)), np.flatnonzero(~free.all(axis=0))
    if boundary or not len(rows):
        return (0, 0), (free.shape[1], free.shape[0])
    return (int(cols[0]), int(rows[0])), (int(cols[-1]) + 1, int(rows[-1]) + 1)


def _repeat(count: int, scale: float) -> npt.NDArray[np.int64]:
    """Return which of ``count`` rows is nearest to each row of ``scale`` times as many."""
    many = max(round(count * scale), 1)
    _check_size((many, 1), "the stretched map")
    return np.minimum(((np.arange(many) + 0.5) / scale).astype(np.int64), count - 1)


def _picture_in_folder(file: Path, named: Any, key: str) -> Path:
    picture = _picture(file, named)
    if picture is None:
        kind = file.suffix[1:]
        raise MapError(
            f"{file.name}: {key}: expected a picture in the folder of the {kind}, found none of the name "
            f"{str(named)[:120]!r}",
            f"put the picture beside the {kind}, and its name into it",
            "missing_file",
        )
    return picture


def _picture(file: Path, named: Any) -> Path | None:
    """The picture of a name, or None."""
    if not isinstance(named, str) or not named or "\0" in named:
        return None
    folder = real_path(file.parent)
    beside = PureWindowsPath(PurePosixPath(named).name).name
    for candidate in (file.parent / named, file.parent / beside):
        try:
            whole = real_path(candidate)
            if whole.is_relative_to(folder) and whole.is_file():
                return whole
        except OSError:  # a name that is too long, a circle of links
            continue
    return None


def _grey_of(file: Path) -> _Picture:
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of pictures that Pillow thinks large; ours are counted below
            with Image.open(file) as image:
                _check_size((image.height, image.width), file.name)
                if image.mode in {"I;16", "I;16B", "I"}:
                    deep = np.asarray(image, np.int64)
                    return _Picture((deep >> (8 if deep.max(initial=0) > 255 else 0)).clip(0, 255).astype(np.uint8))
                told = _told_by(image.info, file.name)
                has_alpha = "A" in image.getbands() or "transparency" in image.info
                if not has_alpha and image.mode in {"L", "1"}:
                    return _Picture(np.asarray(image.convert("L")), None, *told)
                colours = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    except (
        UnidentifiedImageError,
        OSError,
        ValueError,
        SyntaxError,
        MemoryError,
        Image.DecompressionBombError,
    ) as error:
        what = " ".join(str(error).split())[:160]
        raise MapError(f"{file.name} cannot be read as a picture: {what}", "save the map again") from None
    grey = colours[..., :3].sum(axis=2, dtype=np.uint16) // 3
    return _Picture(grey.astype(np.uint8), colours[..., 3] == 0 if has_alpha else None, *told)


def _told_by(texts: Mapping[Any, Any], name: str) -> tuple[bool, float | None, tuple[float, float, float]]:
    """Return what a picture's texts say: whether it has walls alone, its resolution and its origin (R8)."""
    if WALLS_ONLY not in texts:
        return False, None, _NO_ORIGIN
    resolution = texts.get("resolution")
    try:
        origin = decode_yaml(str(texts.get("origin", list(_NO_ORIGIN))), _DEEPEST)
    except ValueError:
        origin = None
    return True, None if resolution is None else _number(resolution, "resolution", name), _origin(origin, name)[0]


def _from_array(file: Path) -> Occupancy:
    """Return the occupancy in a ``.npy`` file: bool is True for occupied, floats are probabilities, NaN is unknown."""
    try:
        array = np.load(file, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise MapError(
            f"{file.name} is no array: {' '.join(str(error).split())[:160]}", "save it with numpy.save"
        ) from None
    return occupancy_from_array(array, file.name)


def occupancy_from_array(array: npt.NDArray[Any], name: str) -> Occupancy:
    """Return the occupancy of an array (rows, cols) by R6; raise MapError if the array is no map."""
    if array.ndim != 2:
        raise MapError(f"{name}: expected rows and columns, found an array of shape {array.shape}", "save one map")
    _check_size(array.shape, name)
    if array.dtype == np.bool_:
        return np.where(array, 100, 0).astype(np.int8)
    if array.dtype.kind == "f":
        known = (array >= 0) & (array <= 1)
        return np.where(known, np.rint(np.where(known, array, 0) * 100), UNKNOWN).astype(np.int8)
    if array.dtype.kind in "iu":
        return np.where((array >= 0) & (array <= 100), array, UNKNOWN).astype(np.int8)
    raise MapError(f"{name}: expected numbers, found an array of {array.dtype}", "save occupancy from 0 to 100")


@contextmanager
def open_bag(path: Path) -> Iterator[Any]:
    """Open a ROS 2 bag, an .mcap or .db3 file or a folder, as rosbags' ``AnyReader``.

    Raises
    ------
    MapError
        There is no such file, or it cannot be read, then or later.
    MissingDependencyError
        rosbags is not installed.
    """
    if not path.exists():
        raise MapError(f"{path}: there is no such file", "check the path", "missing_file")
    if is_device(path):
        raise MapError(f"{path}: expected a file or a folder, found a device or a pipe", "save its content to a file")
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        said = f"{path.name} is a bag; reading it needs rosbags, which is not installed: {install_command('bag')}"
        raise MissingDependencyError(said) from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            yield reader
    except MapError:
        raise
    except Exception as error:  # noqa: BLE001 - the library's own, struct's, sqlite's, lz4's and zstd's
        what = " ".join(str(error).split())[:160] or type(error).__name__
        raise MapError(f"{path.name} cannot be read as a bag: {what}", "record it again") from None


def _from_bag(path: Path, topic: str | None) -> RobotMap:
    """Return the last map that a bag has on a topic."""
    with open_bag(path) as reader:
        maps = [each for each in reader.connections if each.msgtype == GRID_TYPE]
        chosen = _choose_topic([each.topic for each in maps], topic, path.name)
        last = None
        for _, _, last in reader.messages([each for each in maps if each.topic == chosen]):  # noqa: B007
            pass
        message = None if last is None else reader.deserialize(last, GRID_TYPE)
    if message is None:
        raise MapError(f"{path.name}: expected a map on the topic {chosen}, found no message", "record it", "empty")
    return _from_message(message, f"{path.name} {chosen}")


def _choose_topic(topics: list[str], wanted: str | None, name: str) -> str:
    """Return the wanted topic, ``/map``, or the only one that has maps."""
    known = sorted(set(topics))
    if not known:
        raise MapError(f"{name}: expected a topic of type {GRID_TYPE}, found none", "record the topic /map", "empty")
    named = [each for each in known if each.endswith("map") and "costmap" not in each]
    for few in ([wanted] if wanted else ["/map"], known if not wanted else [], named if not wanted else []):
        if len(few) == 1 and few[0] in known:
            return few[0]
    expected = f"the topic {wanted}" if wanted else "one topic with maps"
    raise MapError(f"{name}: expected {expected}, found {', '.join(known)[:200]}", "name one of them")


def _from_message(message: Any, name: str) -> RobotMap:
    """Return the map of a ``nav_msgs/OccupancyGrid``, whose row 0 is at the lowest y."""
    info, place = message.info, message.info.origin
    turn = place.orientation
    yaw = yaw_from_quaternion(turn.x, turn.y, turn.z, turn.w)
    rows, cols = int(info.height), int(info.width)
    _check_size((rows, cols), name)
    cells = np.asarray(message.data)
    if cells.size != rows * cols:
        raise MapError(f"{name}: expected {rows} x {cols} cells, found {cells.size:,}", "record it again")
    occupancy = occupancy_from_array(cells.reshape(rows, cols)[::-1].astype(np.int8), name)
    return RobotMap(occupancy, float(info.resolution), (float(place.position.x), float(place.position.y), yaw), name)


def yaw_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw of a unit quaternion, the rotation about the vertical axis, radians."""
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _check_size(shape: tuple[int, ...], name: str) -> None:
    if math.prod(shape) > MAX_MAP_CELLS:
        found = " x ".join(f"{length:,}" for length in shape)
        raise MapError(f"{name}: expected at most {MAX_MAP_CELLS:,} cells, found {found}", "crop the map", "too_large")


def _origin(value: Any, name: str) -> tuple[tuple[float, float, float], str]:
    """Return x, y (metres) and yaw (radians), and a note if the yaw is unusual (R9)."""
    if not isinstance(value, list) or not 2 <= len(value) <= 3:
        raise MapError(f"{name}: origin: expected [x, y, yaw], found {str(value)[:60]}", "correct it", "bad_units")
    has_yaw = len(value) < 3 or str(value[2]).lower().lstrip("+-.") != "nan"
    x, y, yaw = (_number(each, "origin", name) for each in (*value[:2], *(value[2:] if has_yaw else ()), 0.0)[:3])
    note = "" if has_yaw else "not a number, read as 0"
    if abs(yaw) > math.tau:
        note = f"{yaw:g} radians, more than a full turn; if they are degrees, write {math.radians(yaw):.6g}"
    if note:
        _log.warning("%s: origin: yaw: %s", name, note)
    return (x, y, yaw), note


def _number(value: Any, key: str, name: str) -> float:
    """Return a finite number; YAML reads ``1e-2`` as text."""
    try:
        found = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise MapError(f"{name}: {key}: expected a number, found {str(value)[:40]!r}", "correct it", "bad_units")
    return found


def _flag(value: Any, name: str, key: str) -> bool:
    if value in {0, 1} or isinstance(value, bool):
        return bool(value)
    raise MapError(f"{name}: {key}: expected 0 or 1, found {str(value)[:40]!r}", "correct it")
