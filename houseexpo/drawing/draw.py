"""Draw a plan as an RGB array or as SVG, and arrange pictures of several plans on a sheet.

Pictures show the plan with x right and y up. (Plans of SUNCG keep x = X, y = Z as published, so that a SUNCG house
appears as seen from below its floor; exports to right-handed worlds undo that.)
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from houseexpo.drawing.room_names import LINE, TextLines, load_font, text_length
from houseexpo.drawing.scene import FilledArea, Scene, ThinLine, lay_out_plan
from houseexpo.drawing.styles import INK, PAPER, StyleName, dark_colours
from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import all_rings, fill_cells
from houseexpo.plan.model import PlanData

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage
    from PIL.ImageDraw import ImageDraw

Image = npt.NDArray[np.uint8]

_OVERSAMPLING = 3
_HALO = 0.3  # width around letters, as a share of their size; half of it lies under the letters
_GAP_PX = 16
_SVG_SIZE = re.compile(r'width="(\d+)" height="(\d+)"')


def draw_plan(
    plan: PlanData, pixels_per_metre: float | None = None, *, size: int = 800, style: StyleName = "architect"
) -> Image:
    """Draw a plan as an array of pixels.

    Parameters
    ----------
    plan
        Any plan; if it has no rooms, its label boxes are drawn.
    pixels_per_metre
        Scale; by default, the plan's longer side takes 92% of ``size`` pixels.
    size
        Longer side of the picture in pixels, approximately.
    style
        "architect" (dark walls, door leaves with their swing, pale rooms), "technical" (the same in black and white) or
        "semantic" (rooms in their label's colour, doors coloured by kind, with a legend).

    Returns
    -------
    The picture, (rows, cols, 3) uint8, RGB, with smooth edges.

    Raises
    ------
    ConfigError
        The style is unknown, or the picture would have no size.
    """
    layout = lay_out_plan(plan, pixels_per_metre, size, style)
    image = _paint(layout)
    return _with_words(image, layout)


def svg(
    plan: PlanData, pixels_per_metre: float | None = None, *, size: int = 800, style: StyleName = "architect"
) -> str:
    """Draw a plan as an SVG document and return its text; parameters and errors are those of ``draw_plan``.

    On dark pages, the style "architect" is shown with light lines on dark.
    """
    layout = lay_out_plan(plan, pixels_per_metre, size, style)
    frame, look = _frame(layout, layout.pixels_per_metre), layout.style
    rows, cols = frame.shape
    dark = dark_colours(look, {*plan.room_category, *(room.label for room in plan.rooms)})
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{cols}" height="{rows}" viewBox="0 0 {cols} {rows}">',
        f"<style>text {{ font-family: Helvetica, Arial, sans-serif }}{dark_rules(dark)}</style>",
        f"<title>{escape(plan.id)}</title>",
        f'<rect width="{cols}" height="{rows}" fill="{look.paper}"/>',
        *(_path(area, frame) for area in layout.areas),
        *_svg_lines(layout.lines, frame),
        *(_path(area, frame) for area in layout.key_areas),
        f'<g fill="{look.ink}" paint-order="stroke" stroke-linejoin="round">',
        *(text for words in (*layout.words, *layout.key_words) for text in _svg_words(words, frame)),
        "</g>",
    ]
    return "\n".join([*parts, "</svg>\n"])


def dark_rules(colours: Mapping[str, str]) -> str:
    """Return the CSS that replaces colours of fills and strokes on dark pages."""
    rules = "".join(
        f'[fill="{light}"]{{fill:{dark}}}[stroke="{light}"]{{stroke:{dark}}}' for light, dark in colours.items()
    )
    return f"@media (prefers-color-scheme:dark){{{rules}}}" if rules else ""


def _svg_lines(lines: Iterable[ThinLine], frame: GridFrame) -> Iterator[str]:
    """Return lines as paths, those of one colour and width in one path."""
    by_pen: dict[tuple[str, float], list[str]] = {}
    for line in lines:
        points = frame.pixels_from_points(line.points).round(1).tolist()
        by_pen.setdefault((line.colour, line.width), []).append("M" + " ".join(f"{x:g},{y:g}" for x, y in points))
    for (colour, width), paths in by_pen.items():
        yield f'<path fill="none" stroke="{colour}" stroke-width="{width:.2g}" d="{" ".join(paths)}"/>'


def _svg_words(words: TextLines, frame: GridFrame) -> Iterator[str]:
    """Return lines of text, each squeezed to the width of the measured font if another font is used."""
    x, y = frame.pixels_from_points((words.x, words.y)).tolist()
    anchor = ' text-anchor="middle"' if words.centred else ""
    halo = "" if words.halo is None else f' stroke="{words.halo}" stroke-width="{_HALO * words.size:.1f}"'
    turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if words.turned else ""
    for i, line in enumerate(words.lines):
        baseline = y + (i - (len(words.lines) - 1) / 2) * LINE * words.size + 0.35 * words.size
        fit = f'textLength="{text_length(line, words.size):.1f}" lengthAdjust="spacingAndGlyphs"'
        at = f'x="{x:.1f}" y="{baseline:.1f}" font-size="{words.size:g}"'
        yield f"<text {at} {fit}{anchor}{halo}{turn}>{escape(line)}</text>"


def encode_drawing(plan: PlanData, kind: str, style: StyleName = "architect") -> bytes:
    """Return a drawing of a plan as the bytes of a "png", "svg" or "pdf" file; the last two can be enlarged at will."""
    from PIL import Image as Pillow

    if kind == "svg":
        return svg(plan, style=style).encode()
    stream = io.BytesIO()
    if kind == "png":
        Pillow.fromarray(draw_plan(plan, style=style)).save(stream, "PNG")
        return stream.getvalue()
    from matplotlib.figure import Figure

    from houseexpo.drawing.axes import plot_plan

    figure = Figure(layout="constrained")
    plot_plan(plan, figure.subplots(), style=style)
    figure.savefig(stream, format="pdf", metadata={"CreationDate": None})
    return stream.getvalue()


def contact_sheet(images: Sequence[Image], columns: int, captions: Sequence[str] = ()) -> Image:
    """Arrange pictures (rows, cols, 3) in rows of ``columns`` on one picture, each centred and with its caption below.

    Parameters
    ----------
    images
        Pictures of any sizes, uint8, RGB, as of ``draw_plan``.
    columns
        Number of pictures in a row.
    captions
        One text per picture, or an empty sequence.

    Returns
    -------
    The sheet, (rows, cols, 3) uint8, RGB.

    Raises
    ------
    ConfigError
        There are no pictures, or ``columns`` is less than 1.
    """
    if not images or columns < 1:
        raise ConfigError(f"contact sheet: expected images and columns, found {len(images)} images, {columns} columns")
    from PIL import Image as Pillow
    from PIL import ImageDraw

    size = 13
    wide = max(image.shape[1] for image in images)
    line = 2 * size if captions else 0
    rows = [images[i : i + columns] for i in range(0, len(images), columns)]
    heights = [max(image.shape[0] for image in row) + line + _GAP_PX for row in rows]
    sheet = Pillow.new("RGB", (min(columns, len(images)) * (wide + _GAP_PX) + _GAP_PX, sum(heights) + _GAP_PX), PAPER)
    draw = ImageDraw.Draw(sheet)
    for i, image in enumerate(images):
        row, col = divmod(i, columns)
        left, top = _GAP_PX + col * (wide + _GAP_PX), _GAP_PX + sum(heights[:row])
        tall = heights[row] - line - _GAP_PX
        sheet.paste(Pillow.fromarray(image), (left + (wide - image.shape[1]) // 2, top + (tall - image.shape[0]) // 2))
        if i < len(captions):
            draw.text((left + wide / 2, top + tall + line / 2), captions[i], INK, load_font(size), anchor="mm")
    return np.asarray(sheet).copy()


def svg_sheet(pictures: Sequence[str], columns: int, captions: Sequence[str] = ()) -> str:
    """Arrange SVG documents made by ``svg`` in rows of ``columns``, with captions, and return one document."""
    if not pictures or columns < 1:
        raise ConfigError(f"contact sheet: expected pictures and columns, found {len(pictures)}, {columns} columns")
    sizes = [tuple(map(int, _SVG_SIZE.search(picture).groups())) for picture in pictures]  # type: ignore[union-attr]
    wide = max(size[0] for size in sizes) + _GAP_PX
    parts, top = [], _GAP_PX
    for start in range(0, len(pictures), columns):
        tall = max(size[1] for size in sizes[start : start + columns])
        for i in range(start, min(start + columns, len(pictures))):
            left = _GAP_PX + (i - start) * wide
            x, y = left + (wide - _GAP_PX - sizes[i][0]) // 2, top + (tall - sizes[i][1]) // 2
            parts.append(pictures[i].replace("<svg ", f'<svg x="{x}" y="{y}" ', 1))
            if i < len(captions):
                at = f'x="{left + (wide - _GAP_PX) / 2:g}" y="{top + tall + 17}"'
                parts.append(f'<text {at} font-size="13" text-anchor="middle">{escape(captions[i])}</text>')
        top += tall + (2 * 13 if captions else 0) + _GAP_PX
    width = _GAP_PX + min(columns, len(pictures)) * wide
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{top}" viewBox="0 0 {width} {top}">'
    return "\n".join([head, f'<rect width="{width}" height="{top}" fill="{PAPER}"/>', *parts, "</svg>\n"])


def svg_path_data(rings: Iterable[npt.NDArray[np.float64]], number: Callable[[float], str]) -> str:
    """Return rings (n, 2) as SVG path data: closed subpaths, with y down; ``number`` formats a coordinate."""
    return " ".join(
        "M" + " ".join(f"{number(x)},{number(y)}" for x, y in np.asarray(ring).tolist()) + "Z" for ring in rings
    )


def _frame(layout: Scene, pixels_per_metre: float) -> GridFrame:
    return GridFrame.around(layout.bounds, pixels_per_metre, margin_px=0, y_up=True)


def _paint(layout: Scene) -> Image:
    """Fill the areas on a finer grid and average it; the result is exact to a ninth of a pixel."""
    import cv2

    coarse = _frame(layout, layout.pixels_per_metre)
    rows, cols = (side * _OVERSAMPLING for side in coarse.shape)
    fine = GridFrame(coarse.origin_m, coarse.pixels_per_metre * _OVERSAMPLING, (rows, cols), y_up=True)
    areas = (*layout.areas, *layout.key_areas)
    paper, pens = layout.style.paper, (line.colour for line in layout.lines)
    palette = list(dict.fromkeys([paper, *(area.fill for area in areas), *pens]))  # a picture has a few dozen colours
    index = np.zeros(fine.shape, dtype=np.uint8)
    for area in areas:
        fill_cells(index, area.shape, fine, palette.index(area.fill))
    for line in layout.lines:
        # OpenCV counts from the middle of the first pixel, in sixteenths
        points = np.rint((fine.pixels_from_points(line.points) - 0.5) * 16).astype(np.int32)
        width = max(round(line.width * _OVERSAMPLING), 1)
        cv2.polylines(index, [points], isClosed=False, color=palette.index(line.colour), thickness=width, shift=4)
    colours = np.zeros((256, 1, 3), dtype=np.uint8)
    colours[: len(palette), 0] = [_rgb(colour) for colour in palette]
    image = cv2.applyColorMap(index, colours)  # three times as fast as NumPy's take
    return np.asarray(cv2.resize(image, coarse.shape[::-1], interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _with_words(image: Image, layout: Scene) -> Image:
    from PIL import Image as Pillow
    from PIL import ImageDraw as Drawing

    frame, ink = _frame(layout, layout.pixels_per_metre), layout.style.ink
    picture = Pillow.fromarray(image)
    for words in (*layout.words, *layout.key_words):
        x, y = frame.pixels_from_points((words.x, words.y)).tolist()
        if words.turned:
            _paste_turned(picture, (x, y), words, ink)
        else:
            _write_lines(Drawing.Draw(picture), (x, y), words, ink)
    return np.asarray(picture).copy()


def _write_lines(draw: ImageDraw, at: tuple[float, float], words: TextLines, ink: str) -> None:
    for i, line in enumerate(words.lines):
        middle = at[1] + (i - (len(words.lines) - 1) / 2) * LINE * words.size
        _write(draw, (at[0], middle), line, words, ink)


def _paste_turned(picture: PillowImage, at: tuple[float, float], words: TextLines, ink: str) -> None:
    """Write lines that read upwards, centred: the picture is turned there, and back."""
    from PIL import Image as Pillow
    from PIL import ImageDraw as Drawing

    wide = math.ceil(max(text_length(line, words.size) for line in words.lines) / 2) + 2
    high = math.ceil(LINE * words.size * len(words.lines) / 2) + 2
    left, top = round(at[0]) - high, round(at[1]) - wide
    part = picture.crop((left, top, left + 2 * high, top + 2 * wide)).transpose(Pillow.Transpose.ROTATE_270)
    _write_lines(Drawing.Draw(part), (wide, high), words, ink)
    picture.paste(part.transpose(Pillow.Transpose.ROTATE_90), (left, top))


def _write(draw: ImageDraw, at: tuple[float, float], line: str, words: TextLines, ink: str) -> None:
    """Write a line; a superscript 2 at its end, which Pillow's font lacks, becomes a small raised 2."""
    (x, y), size = at, words.size
    text, font, small = line.removesuffix("²"), load_font(size), load_font(0.6 * size)
    letters = [(x, y, text, font)]
    if text != line:
        left = x - (font.getlength(text) + small.getlength("2")) / 2 if words.centred else x
        letters = [(left, y, text, font), (left + font.getlength(text), y - 0.25 * size, "2", small)]
    anchor = "mm" if words.centred and text == line else "lm"
    for each_x, each_y, each, type_ in letters if words.halo else ():
        stroke = _HALO * size / 2
        draw.text((each_x, each_y), each, words.halo, type_, anchor=anchor, stroke_width=stroke, stroke_fill=words.halo)
    for each_x, each_y, each, type_ in letters:
        draw.text((each_x, each_y), each, ink, type_, anchor=anchor)


def _rgb(colour: str) -> tuple[int, int, int]:
    """Convert ``#rrggbb`` to three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:7])
    return red, green, blue


def _path(area: FilledArea, frame: GridFrame) -> str:
    """Return an area as an SVG path, with holes by the even-odd rule."""
    rings = [frame.pixels_from_points(ring).round(2) for ring in all_rings(area.shape)]
    steps = svg_path_data(rings, "{:g}".format)
    return f'<path fill="{area.fill}" fill-rule="evenodd" d="{steps}"/>'
