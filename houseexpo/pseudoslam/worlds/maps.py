"""Read a robot's map, a picture or an array as a house of the simulator, without a plan in between.

R1  Cells keep the map's own size, unless a configuration is given with another ``pixels_per_metre``.
R2  Resampled to larger cells, a cell is occupied if any part of it is; smaller cells copy the one that they lie in.
R3  Unknown cells block the robot and the laser, or are free if ``unknown`` says so. Outside of the map is occupied.
R4  Coordinates are those of the map's frame: x right, y up, in metres, as ``map.yaml`` says them. A map with a yaw is
    turned first, onto cells along the axes of this frame (``RobotMap.upright``).
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, TypeAlias, Union, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_number, check_one_of
from houseexpo.dataset import Dataset, open_dataset
from houseexpo.errors import ConfigError
from houseexpo.file_kinds import PICTURES
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.robot_map import (
    OCCUPIED_THRESH,
    MapError,
    RobotMap,
    drop_map_pictures,
    is_bag_folder,
    is_map_file,
    occupancy_from_array,
    read_map,
)
from houseexpo.pseudoslam.worlds.world import MAX_WORLD_CELLS

Unknown = Literal["occupied", "free"]
_SAME_RESOLUTION: Final = 1e-9
"""Relative difference up to which two resolutions are the same."""
_PLAN_FILES: Final = ("*.json", "*.jsonl", "*.jsonl.gz", "*.parquet", "*/*.json", "*/*.parquet")


@dataclass(frozen=True, eq=False)
class MapHouse:
    """A house that is known only as cells.

    Parameters
    ----------
    id
        Its id, in the place of a plan's.
    occupied
        (rows, cols) uint8, row 0 at the highest y, read-only: 1 occupied, 0 free.
    frame
        The place of the cells, with ``y_up``.
    """

    id: str
    occupied: npt.NDArray[np.uint8]
    frame: GridFrame

    def __post_init__(self) -> None:
        cells = np.array(self.occupied, np.uint8)
        cells.flags.writeable = False
        object.__setattr__(self, "occupied", cells)
        if cells.shape != self.frame.shape or not self.frame.y_up:
            raise ConfigError(
                f"map {self.id!r}: expected a frame with y_up of {cells.shape} cells, found {self.frame!r}"
            )

    @property
    def pixels_per_metre(self) -> float:
        """The number of cells per metre."""
        return self.frame.pixels_per_metre

    @property
    def digest(self) -> str:
        """The SHA-256 of the cells and their size."""
        shape = f"{self.occupied.shape} {self.pixels_per_metre!r} {self.frame.origin_m}"
        return hashlib.sha256(shape.encode() + np.packbits(self.occupied).tobytes()).hexdigest()

    def resample(self, pixels_per_metre: float) -> MapHouse:
        """Return the house with cells of another size (R2); the upper left corner stays in its place.

        Raises
        ------
        ConfigError
            There would be more than ``MAX_WORLD_CELLS`` cells.
        """
        scale = pixels_per_metre / self.pixels_per_metre
        if abs(scale - 1.0) <= _SAME_RESOLUTION:
            return self
        rows, cols = (math.ceil(length * scale - 1e-6) for length in self.occupied.shape)
        if rows * cols > MAX_WORLD_CELLS:
            raise ConfigError(
                f"pixels_per_metre: {pixels_per_metre:g} makes {rows * cols:.2g} cells of map {self.id!r}, "
                f"at most {MAX_WORLD_CELLS:.0e} are possible; use a coarser grid"
            )
        cells = _pool_rows(_pool_rows(self.occupied, rows, scale).T, cols, scale).T
        x_m, y_m = self.frame.origin_m
        top_m = y_m + self.occupied.shape[0] / self.pixels_per_metre
        origin_m = (x_m, top_m - rows / pixels_per_metre)
        return _house(self.id, np.ascontiguousarray(cells), origin_m, pixels_per_metre)

    def with_border(self) -> MapHouse:
        """Return the house with an occupied border, around the map unless its own border is occupied (R3)."""
        if self.occupied[[0, -1]].all() and self.occupied[:, [0, -1]].all():
            return self
        x_m, y_m = self.frame.origin_m
        origin_m = (x_m - self.frame.cell_m, y_m - self.frame.cell_m)
        return _house(self.id, np.pad(self.occupied, 1, constant_values=1), origin_m, self.pixels_per_metre)


House: TypeAlias = FloorPlan | MapHouse
Plans: TypeAlias = Union[str, "os.PathLike[str]", FloorPlan, MapHouse, Sequence[FloorPlan], Sequence[MapHouse]]


def map_house(
    cells: RobotMap | npt.ArrayLike,
    resolution: float | None = None,
    *,
    origin_m: tuple[float, float] = (0.0, 0.0),
    unknown: Unknown = "occupied",
    name: str = "map",
) -> MapHouse:
    """Return the house of a robot's map or of an array.

    Parameters
    ----------
    cells
        A ``RobotMap``, or an array (rows, cols) with row 0 at the highest y: bool, True for occupied; floats, the
        probability of that, NaN for unknown; or integers, occupancy from 0 to 100, others for unknown.
    resolution
        The side of a cell of an array, metres; a ``RobotMap`` has its own.
    origin_m
        The lower left corner of an array, (x, y) in metres.
    unknown
        What unknown cells are (R3).
    name
        The id of the house.

    Raises
    ------
    ConfigError
        The array is no map, its cells have no size, or it has no free cell.

    Examples
    --------
    >>> walls = np.zeros((40, 60), bool)
    >>> house = map_house(walls, 0.1)
    >>> house.occupied.shape, house.pixels_per_metre
    ((40, 60), 10.0)
    """
    check_one_of(unknown, "unknown", get_args(Unknown))
    if not isinstance(cells, RobotMap):
        if resolution is None:
            raise ConfigError(f"map {name!r}: resolution: expected the side of a cell in metres, found none")
        check_number(resolution, "resolution", above=0.0)
        try:
            cells = RobotMap(occupancy_from_array(np.asarray(cells), name), resolution, (*origin_m, 0.0), name)
        except MapError as error:
            raise ConfigError(f"map {name!r}: {error}") from None
    cells = cells.upright()
    x_m, y_m, _ = cells.origin
    free = cells.free if unknown == "occupied" else ~cells.occupied
    if not free.any():
        raise ConfigError(f"map {name!r}: expected free space, found no free cell")
    return _house(name, (~free).view(np.uint8), (x_m, y_m), _per_metre(cells.resolution_m))


def open_maps(
    path: str | os.PathLike[str],
    resolution: float | None = None,
    *,
    unknown: Unknown = "occupied",
    negate: bool = False,
    occupied_thresh: float = OCCUPIED_THRESH,
    free_thresh: float | None = None,
) -> list[MapHouse]:
    """Read the maps of a file or of a folder, in the order of their names; ids are the names without the suffix.

    Files are those of ``grids.read_map``: map_server's ``map.yaml``, pictures, arrays (.npy) and bags. In a folder, a
    picture that belongs to a ``map.yaml`` there is read with it.

    Parameters
    ----------
    resolution
        The side of a cell of pictures and arrays, metres; a ``map.yaml`` says its own.
    unknown
        What unknown cells are (R3).
    negate, occupied_thresh, free_thresh
        How pictures alone are read, see ``grids.read_map``.

    Raises
    ------
    ConfigError
        There is no map, or one cannot be read.
    """
    place = Path(path)
    files = _map_files(place) if place.is_dir() and not is_bag_folder(place) else [place]
    if not files:
        raise ConfigError(f"{place}: expected maps (map.yaml, {', '.join(PICTURES[:3])}, .npy), found none")
    houses = []
    for file in files:
        try:
            found = read_map(file, resolution, negate=negate, occupied_thresh=occupied_thresh, free_thresh=free_thresh)
        except MapError as error:
            raise ConfigError(f"{file}: {str(error).removeprefix(f'{file.name}: ')}") from None
        houses.append(map_house(found, unknown=unknown, name=file.stem))
    return houses


def has_maps(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a map, or a folder of maps without plans."""
    place = Path(path)
    if place.is_dir():
        if is_bag_folder(place):
            return True
        return not any(any(place.glob(kind)) for kind in _PLAN_FILES) and bool(_map_files(place))
    return place.is_file() and is_map_file(place)


def open_houses(source: Plans) -> Dataset | Sequence[FloorPlan] | Sequence[MapHouse]:
    """Return houses as a sequence: of a data set or its path, of maps or their path, of lists, or of a single house.

    Raises
    ------
    ConfigError
        There is no house, or an item of a list is not a house.
    """
    found: object = source
    if isinstance(source, (str, os.PathLike)):
        found = open_maps(source) if has_maps(source) else open_dataset(source)
    if isinstance(found, (FloorPlan, MapHouse)):
        found = [found]
    listed = found if isinstance(found, (list, tuple)) else ()  # plans of a data set are read later
    alike = {isinstance(house, MapHouse) for house in listed}
    known = all(isinstance(house, (FloorPlan, MapHouse)) for house in listed)
    is_no_list = isinstance(found, (str, bytes, bytearray, range))
    if not isinstance(found, Sequence) or is_no_list or not known or len(alike) > 1:
        raise ConfigError(
            f"dataset: expected a data set or its path, a plan, a list of plans, or maps, found {found!r}"
        )
    if len(found) == 0:
        raise ConfigError("dataset: expected at least one plan, found none")
    return found


def common_resolution(houses: Sequence[House]) -> float | None:
    """Return the cells per metre that maps have in common, None for plans.

    Raises
    ------
    ConfigError
        Maps have different resolutions.
    """
    first = houses[0] if isinstance(houses, (list, tuple)) else None
    if not isinstance(first, MapHouse):
        return None
    for house in houses:
        if isinstance(house, MapHouse) and abs(house.pixels_per_metre / first.pixels_per_metre - 1) > _SAME_RESOLUTION:
            raise ConfigError(
                f"dataset: maps of {first.pixels_per_metre:g} ({first.id}) and {house.pixels_per_metre:g} "
                f"({house.id}) cells per metre; give a configuration, to whose pixels_per_metre they are resampled"
            )
    return first.pixels_per_metre


def _map_files(folder: Path) -> list[Path]:
    """Return the maps in a folder, without pictures that belong to a ``map.yaml``."""
    return drop_map_pictures(sorted(file for file in folder.iterdir() if file.is_file() and is_map_file(file)))


def _per_metre(side_m: float) -> float:
    """Return the cells per metre of a side in metres, whole if it is so but for rounding."""
    found = 1.0 / side_m
    return float(round(found)) if abs(found - round(found)) <= _SAME_RESOLUTION * found else found


def _house(
    name: str, occupied: npt.NDArray[np.uint8], origin_m: tuple[float, float], pixels_per_metre: float
) -> MapHouse:
    rows, cols = occupied.shape
    return MapHouse(name, occupied, GridFrame(origin_m, pixels_per_metre, (rows, cols), y_up=True))


def _pool_rows(cells: npt.NDArray[np.uint8], rows: int, scale: float) -> npt.NDArray[np.uint8]:
    """Resample rows: each new row is the maximum of the rows that it touches; rows beyond the last are occupied."""
    edges = np.arange(rows + 1) / scale
    first = np.floor(edges[:-1] + 1e-6).astype(np.int64)
    end = np.maximum(np.ceil(edges[1:] - 1e-6).astype(np.int64), first + 1)
    room = max(int(end.max()) + 1 - len(cells), 1)
    padded = np.pad(cells, ((0, room), (0, 0)), constant_values=1)
    if scale > 1.0:  # R2: the cell in which the middle lies
        middle = np.floor((edges[:-1] + edges[1:]) / 2).astype(np.int64)
        return np.asarray(padded[middle])
    return np.asarray(np.maximum.reduceat(padded, np.column_stack([first, end]).ravel(), axis=0)[::2])
