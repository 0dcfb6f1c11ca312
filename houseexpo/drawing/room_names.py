"""Find places for the names of rooms: boxes of text that lie within their room and overlap nothing.

N1  Name and area are tried as a whole, then the name alone; on one line, on several, and turned by 90 degrees.
N2  The box lies in the room. It keeps clear of furniture and door leaves; where that leaves no place, of door leaves
    alone, with smaller letters, or within their arcs.
N3  It stands where most space is around it and, of several such places, nearest to the room's centroid.
N4  Letters have the picture's size or a little less; a name that does not fit in the smallest is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import fill_cells

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont
    from shapely import MultiPolygon, Polygon

IntGrid: TypeAlias = npt.NDArray[np.int32]

SMALLEST_PX: Final = 8.0
"""Smaller letters cannot be read."""
LINE: Final = 1.2
"""Distance between lines, in sizes of letters."""
_SIDE_SPACE: Final = 0.35  # beside the letters, on each side, in sizes
_SLIGHTLY: Final = 0.85  # of the size: letters so much smaller are still taken for equal
_CELL_PX: Final = 1.5  # of the grid in which places are sought; finer than what is seen
_CELLS_ALONG_ROOM: Final = 160  # of it along a room, at most


@dataclass(frozen=True)
class TextLines:
    """Lines of text, centred on a point in metres or starting there; ``size`` is in pixels.

    Text that is ``turned`` reads upwards. ``halo`` is the colour around the letters, which parts them from the lines
    that they cross.
    """

    x: float
    y: float
    lines: tuple[str, ...]
    size: float
    centred: bool = True
    turned: bool = False
    halo: str | None = None

    def box_m(self, pixels_per_metre: float) -> tuple[float, float]:
        """Return the width and height of the box around centred text, across and up, metres."""
        across, up = (side / pixels_per_metre for side in _box_px(self.lines, self.size))
        return (up, across) if self.turned else (across, up)


@lru_cache(maxsize=64)  # a new font object would be unpacked, and its glyphs drawn, again
def load_font(size: float) -> FreeTypeFont:
    """Return the font that comes with Pillow, so that pictures look the same on every machine."""
    from PIL import ImageFont

    return ImageFont.load_default(size)  # type: ignore[return-value]  # a FreeTypeFont wherever a size is given


@lru_cache(maxsize=4096)  # plans have the same few names
def text_length(text: str, size: float) -> float:
    """Return the width of a line in pixels; the font has no superscript 2, and a plain one is the wider."""
    return load_font(size).getlength(text.replace("²", "2"))


def place_name(
    room: Polygon,
    swings: Sequence[Polygon | MultiPolygon],
    furniture: Sequence[Polygon | MultiPolygon],
    words: Sequence[str],
    *,
    pixels_per_metre: float,
    size: float,
    halo: str,
) -> TextLines | None:
    """Return a room's name where it fits, or None.

    Parameters
    ----------
    room
        The room with the floor under its furniture, metres.
    swings, furniture
        What the name keeps clear of (N2).
    words
        The name, and below it the area; alternatives in the name are divided by " / ".
    pixels_per_metre, size, halo
        The scale of the picture, the size of its letters in pixels, and the colour of the room.
    """
    sizes = sorted({size, max(_SLIGHTLY * size, SMALLEST_PX), SMALLEST_PX}, reverse=True)
    places = _Places(room, swings, furniture, pixels_per_metre)
    ways = [*product(sizes, places.clear), *product(sizes, [places.inside])]
    for (letters, sums), (lines, turned) in product(ways, _arrangements(words)):
        across, up = (side / pixels_per_metre for side in _box_px(lines, letters))
        found = places.find(sums, *((up, across) if turned else (across, up)))
        if found is not None:
            return TextLines(*found, lines, letters, turned=turned, halo=halo)
    return None


def _arrangements(words: Sequence[str]) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Yield lines and whether they are turned, in order of preference (N1)."""
    for k in range(len(words), 0, -1):
        name, *area = words[:k]
        stack = name.split(" / ") if " / " in name else name.split(" ")
        yield (name, *area), False
        if len(stack) > 1 and not name.endswith("²"):
            yield (*stack, *area), False
        yield (name, *area), True


def _box_px(lines: Iterable[str], size: float) -> tuple[float, float]:
    lines = tuple(lines)
    return max(text_length(line, size) for line in lines) + 2 * _SIDE_SPACE * size, LINE * size * len(lines)


class _Places:
    """The places in a room where a box may stand."""

    def __init__(
        self,
        room: Polygon,
        swings: Sequence[Polygon | MultiPolygon],
        furniture: Sequence[Polygon | MultiPolygon],
        pixels_per_metre: float,
    ) -> None:
        x1, y1, x2, y2 = room.bounds
        extent = max(x2 - x1, y2 - y1)
        self.room = room
        self.cell_m = max(_CELL_PX / pixels_per_metre, extent / _CELLS_ALONG_ROOM)
        self.frame = GridFrame.around(room.bounds, 1 / self.cell_m, margin_px=1)
        inside = np.zeros(self.frame.shape, np.uint8)
        fill_cells(inside, room, self.frame, 1)
        self.inside = _sums(inside)
        self.clear: list[IntGrid] = []  # of swings and furniture, of swings, of the lines of swings
        lines = [swing.boundary.buffer(self.cell_m) for swing in swings]
        for shapes in (lines, swings, furniture):
            for shape in shapes:
                fill_cells(inside, shape, self.frame, 0)
            if shapes:
                self.clear.insert(0, _sums(inside))
        centre = room.centroid
        self.centre = self.frame.pixels_from_points((centre.x, centre.y))

    def find(self, sums: IntGrid, across_m: float, up_m: float) -> tuple[float, float] | None:
        """Return the middle of the best place for a box, metres, or None (N3); ``sums`` is one of the room's."""
        import shapely

        wide, high = (math.ceil(side / self.cell_m) + 1 for side in (across_m, up_m))
        rows, cols = sums.shape
        if wide >= cols or high >= rows:
            return None
        covered = sums[high:, wide:] - sums[:-high, wide:] - sums[high:, :-wide] + sums[:-high, :-wide]
        fits = covered == wide * high
        if not fits.any():
            return None
        row, col = self._best(fits, wide, high)
        x, y = self.frame.points_from_pixels((col + wide / 2, row + high / 2)).tolist()
        box = shapely.box(x - across_m / 2, y - up_m / 2, x + across_m / 2, y + up_m / 2)
        return (x, y) if self.room.covers(box) else None

    def _best(self, fits: npt.NDArray[np.bool_], wide: int, high: int) -> tuple[int, int]:
        import cv2

        space = cv2.distanceTransform(np.pad(fits.view(np.uint8), 1), cv2.DIST_L2, cv2.DIST_MASK_3)[1:-1, 1:-1]
        rows, cols = np.nonzero(space >= space.max() - 0.5)
        far = np.hypot(cols + wide / 2 - self.centre[0], rows + high / 2 - self.centre[1])
        best = int(np.argmin(far))
        return int(rows[best]), int(cols[best])


def _sums(mask: npt.NDArray[np.uint8]) -> IntGrid:
    """Return the sums of all cells above and left of each corner, (rows + 1, cols + 1)."""
    import cv2

    return np.asarray(cv2.integral(mask, sdepth=cv2.CV_32S))
