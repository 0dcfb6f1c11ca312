"""A picture of plan areas to scale, with a title, a legend and the source's metres on its edges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image, ImageDraw
from shapely.geometry.base import BaseGeometry

from houseexpo.drawing.scene import INK, PAPER, font
from houseexpo.plan import Box, Frame
from pipeline.geometry.overlay import polygons_of

Picture = npt.NDArray[np.uint8]
Legend = Sequence[tuple[str, str]]

SIDE_PX = 900
FINE = 2  # drawn larger by this and scaled down, so that edges are smooth
MARGIN_M, MARGIN_SHARE = 0.5, 0.03
TICKS = 12  # at most, along one edge
STEPS_M = (0.5, 1, 2, 5, 10, 20, 50)
RULER = "#9aa0a6"


class Canvas:
    """Areas in metres painted over each other, with a legend below."""

    def __init__(self, bounds: Box) -> None:
        x1, y1, x2, y2 = bounds
        margin = max(MARGIN_M, MARGIN_SHARE * max(x2 - x1, y2 - y1))
        self.bounds = x1 - margin, y1 - margin, x2 + margin, y2 + margin
        self.origin = np.array([x1 - margin, y2 + margin])
        width, height = x2 - x1 + 2 * margin, y2 - y1 + 2 * margin
        self.scale = SIDE_PX * FINE / max(width, height)
        self.image = Image.new("RGB", (round(width * self.scale), round(height * self.scale)), PAPER)

    def fill(self, shape: BaseGeometry, colour: str) -> None:
        """Paint every polygon of a geometry, holes left out."""
        for polygon in polygons_of(shape):
            outer, holes = self._pixels(polygon.exterior), [self._pixels(hole) for hole in polygon.interiors]
            (left, top), (right, bottom) = np.min(outer, axis=0), np.max(outer, axis=0)
            x, y = max(math.floor(left), 0), max(math.floor(top), 0)
            size = min(math.ceil(right) + 1, self.image.width) - x, min(math.ceil(bottom) + 1, self.image.height) - y
            if min(size) <= 0:
                continue
            mask = Image.new("1", size)  # no larger than it has to be: a large picture takes milliseconds to paste
            pen = ImageDraw.Draw(mask)
            for fill, ring in ((1, outer), *((0, hole) for hole in holes)):
                pen.polygon([(px - x, py - y) for px, py in ring], fill=fill)
            self.image.paste(colour, (x, y), mask)

    def trace(self, path: npt.NDArray[np.float64], colour: str) -> None:
        """Draw a thin line through points (n, 2)."""
        ImageDraw.Draw(self.image).line(self._pixels(shapely.linestrings(path)), fill=colour, width=2 * FINE)

    def write(self, at: tuple[float, float], words: str, size: float = 13) -> None:
        """Write words about a point, metres, on a pale ground."""
        pen = ImageDraw.Draw(self.image)
        (x, y), type_ = self._pixel(at), font(size * FINE)
        pen.rectangle(pen.textbbox((x, y), words, font=type_, anchor="mm"), fill=PAPER)
        pen.text((x, y), words, fill=INK, font=type_, anchor="mm")

    def ruler(self, frame: Frame) -> None:
        """Write the metres of the source's plan axes along the lower and the left edge.

        A frame that turns its axes has no ruler.
        """
        (a, b, tx), (c, d, ty) = frame.matrix
        if b or c:
            return
        x1, y1, x2, y2 = self.bounds
        pen, type_ = ImageDraw.Draw(self.image), font(11 * FINE)
        for x, words in ruler_ticks(x1, x2, a, tx):
            at = self._pixel((x, y1))
            pen.line((at[0], at[1] - 4 * FINE, *at), fill=RULER, width=FINE)
            pen.text((at[0], at[1] - 5 * FINE), words, fill=RULER, font=type_, anchor="mb")
        for y, words in ruler_ticks(y1, y2, d, ty):
            at = self._pixel((x1, y))
            pen.line((at[0], at[1], at[0] + 4 * FINE, at[1]), fill=RULER, width=FINE)
            pen.text((at[0] + 6 * FINE, at[1]), words, fill=RULER, font=type_, anchor="lm")

    def finished(self, title: str, legend: Legend) -> Picture:
        """Scale down, and add title and legend."""
        width, height = self.image.size
        small = self.image.reduce(FINE).crop((0, 0, width // FINE, height // FINE))
        page = Image.new("RGB", (max(small.width, 520), small.height + 64), PAPER)
        page.paste(small, ((page.width - small.width) // 2, 0))
        pen = ImageDraw.Draw(page)
        pen.text((12, small.height + 6), title, fill=INK, font=font(17))
        x = 12.0
        for name, colour in legend:
            pen.rectangle((x, small.height + 38, x + 14, small.height + 52), fill=colour, outline=INK)
            pen.text((x + 20, small.height + 36), name, fill=INK, font=font(14))
            x += 34 + pen.textlength(name, font=font(14))
        return np.asarray(page, np.uint8)

    def _pixel(self, at: tuple[float, float]) -> tuple[float, float]:
        x, y = (np.array(at) - self.origin) * [self.scale, -self.scale]
        return float(x), float(y)

    def _pixels(self, ring: BaseGeometry) -> list[tuple[float, float]]:
        points = (shapely.get_coordinates(ring) - self.origin) * [self.scale, -self.scale]
        return [(float(x), float(y)) for x, y in points]


def ruler_ticks(low: float, high: float, factor: float, shift: float) -> Iterator[tuple[float, str]]:
    """Yield places on a level's axis, metres, where the source's has whole steps, and the source's metres there.

    The source's metres are ``factor`` times the level's, plus ``shift``. Close to the ends there is no room for words.
    """
    step = next((step for step in STEPS_M if (high - low) / step <= TICKS), STEPS_M[-1])
    first, last = sorted((factor * low + shift, factor * high + shift))
    for k in range(math.ceil(first / step + 0.25), math.floor(last / step - 0.25) + 1):
        yield (k * step - shift) / factor, f"{k * step:g}"
