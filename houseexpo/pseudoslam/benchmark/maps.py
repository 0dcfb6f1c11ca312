"""Read other projects' maps as houses for the benchmark, by the rules of those projects, with their start poses.

R1  ``kth`` and PIPE's classes of its floors (castacks/MapEx, its ``kth_test_maps`` as pictures): black is occupied, a
    pixel is 0.05 m. MapEx joins 2 x 2 pixels to a cell of 0.1 m, which is occupied if any of them is. ``starts.txt``
    has a line for each run, ``FLOOR --start_pose ROW COLUMN``, in cells of MapEx's grid, which has 500 free cells on
    each side.
R2  ``dare`` (marmotlab/DARE, ``maps_test``): 2 x 2 pixels are joined to a cell of 0.4 m with the least of their values.
    Values above 150 and from 50 to 80 are free. The start is the eleventh cell of value 208, in the order of rows. The
    simulator divides each cell into 2 x 2, since the steps of explorers must be longer than a cell.
R3  ``ariadne`` (marmotlab/ARiADNE, ``DungeonMaps``): a pixel is a cell, free above 150. The start is the 128th cell of
    value 208. Its lengths are in cells; a lidar of 80 cells is one of 20 m here, so that a cell is 0.25 m.
R4  On other tracks, maps are read by ``worlds.maps`` and starts are drawn as in plans.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.cases import Case, make_cases, seed_from_words
from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, Track
from houseexpo.pseudoslam.worlds.maps import MapHouse, map_house, open_maps

STARTS: Final = "starts.txt"
_MARGIN_CELLS: Final = 500
_KTH_M: Final = 0.05
_START: Final = 208
"""The value of the cells of the start in maps of DARE and ARiADNE."""

Pose = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class StartedHouse(MapHouse):
    """A house with the poses from which its robots start."""

    starts: tuple[Pose, ...] = ()


def read_maps(track: Track, folder: Path, resolution: float | None = None) -> list[MapHouse]:
    """Return the maps of a folder as houses, in the order of their names, read by the rules of the track.

    Parameters
    ----------
    resolution
        The side of a cell of pictures and arrays, metres; the tracks of maps know their own.

    Raises
    ------
    ConfigError
        There is no map, one cannot be read, or its starts are missing.
    """
    if track not in MAP_TRACKS:
        return open_maps(folder, resolution)
    files = sorted(folder.glob("*.png"))
    if not files:
        raise ConfigError(f"--maps {folder}: expected the pictures of track {track.id}, found no .png")
    if track.name not in {"dare", "ariadne"}:
        return _kth(folder, files, track)
    joined, side_m = (2, 0.4) if track.name == "dare" else (1, 0.25)
    return [_dungeon(file, joined, side_m, track.config.pixels_per_metre) for file in files]


def map_cases(track: Track, houses: list[MapHouse]) -> list[Case]:
    """Return a case for each start of the houses, or for each house if they have none."""
    found = []
    for house in houses:
        if not isinstance(house, StartedHouse):
            found += make_cases(track.id, [house.id])
        else:
            seeds = [seed_from_words(track.id, f"{house.id} {number}") for number in range(len(house.starts))]
            found += [Case(house.id, seed, pose) for seed, pose in zip(seeds, house.starts, strict=True)]
    return found


def maps_sha256(houses: list[MapHouse]) -> str:
    """Return the hash of the contents of maps, in order."""
    return hashlib.sha256("".join(house.digest for house in houses).encode()).hexdigest()


def _with_starts(house: MapHouse, starts: list[Pose]) -> StartedHouse:
    return StartedHouse(house.id, house.occupied, house.frame, tuple(starts))


def _kth(folder: Path, files: list[Path], track: Track) -> list[MapHouse]:
    """The floors of a track that have starts."""
    listed = folder / STARTS
    if not listed.is_file():
        raise ConfigError(f"--maps {folder}: expected {STARTS} with the starts of the floors, found none")
    starts: dict[str, list[tuple[int, int]]] = {}
    for line in listed.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if not words:
            continue
        try:
            name, _, row, col = words
            starts.setdefault(name, []).append((int(row) - _MARGIN_CELLS, int(col) - _MARGIN_CELLS))
        except ValueError:
            raise ConfigError(f"{listed}: expected FLOOR --start_pose ROW COLUMN, found {line!r}") from None
    starts = {name: found for name, found in starts.items() if name in (track.floors or starts)}
    if not starts:
        raise ConfigError(f"{listed}: expected a start on {' or '.join(track.floors) or 'a floor'}, found none")
    missing = sorted(set(starts) - {file.stem for file in files})
    if missing:
        raise ConfigError(f"--maps {folder}: expected a picture of floor {missing[0]}, found none")
    found: list[MapHouse] = []
    for file in files:
        if file.stem in starts:
            house = map_house(_pixels(file) < 128, _KTH_M, name=file.stem).resample(track.config.pixels_per_metre)
            found.append(_with_starts(house, [_pose(house, *cell) for cell in starts[file.stem]]))
    return found


def _dungeon(file: Path, joined: int, side_m: float, pixels_per_metre: float) -> StartedHouse:
    """Return the house of a picture of DARE's or ARiADNE's, with the start that their code takes."""
    pixels = _pixels(file)
    rows, cols = (length // joined for length in pixels.shape)
    cells = pixels[: rows * joined, : cols * joined].reshape(rows, joined, cols, joined).min(axis=(1, 3))
    marked, number = np.argwhere(cells == _START), 10 if joined == 2 else 127
    if len(marked) <= number:
        raise ConfigError(f"{file}: expected the start, {number + 1} cells of value {_START}, found {len(marked)}")
    free = (cells > 150) | ((cells >= 50) & (cells <= 80)) if joined == 2 else cells > 150
    house = map_house(~free, side_m, name=file.stem)
    pose = _pose(house, *marked[number].tolist())
    return _with_starts(house.resample(pixels_per_metre), [pose])


def _pixels(file: Path) -> npt.NDArray[Any]:
    """Return the grey values (rows, cols) of a picture, rounded down as the programs do."""
    from PIL import Image

    try:
        with Image.open(file) as image:
            if image.mode == "L":
                return np.asarray(image)
            colours = np.asarray(image.convert("RGB"), np.float64)
    except OSError as error:
        raise ConfigError(f"{file}: expected a picture, found {error}") from None
    grey = colours @ (0.2125, 0.7154, 0.0721)  # the weights of scikit-image, with which ARiADNE reads them
    return np.floor(grey + 1e-6).astype(np.uint8)


def _pose(house: MapHouse, row: int, col: int) -> Pose:
    """Return the pose in the middle of a cell, heading along x."""
    return *house.frame.point_from_pixel(col + 0.5, row + 0.5), 0.0
