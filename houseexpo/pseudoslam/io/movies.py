"""Write a sequence of pictures as a GIF or MP4 file."""

from __future__ import annotations

import itertools
import os
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.files import PARTIAL, make_folder, name_in_os_errors
from houseexpo.pseudoslam.render import picture as render
from houseexpo.pseudoslam.render.canvas import Image

_HOLD_S = 1.5  # a GIF shows its last picture for this time


def write_movie(pictures: Iterable[Image], path: str | os.PathLike[str], fps: float) -> None:
    """Write pictures (rows, cols, 3) uint8 of one size to a movie; the file's extension determines the format.

    The file is replaced only when the movie is complete; if a picture cannot be made, the old file stays.

    Raises
    ------
    ConfigError
        The extension is neither .gif nor .mp4, or ``fps`` is not a valid number of pictures per second.
    MissingDependencyError
        OpenCV cannot write MP4 on this machine.
    """
    target = Path(path)
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    if target.suffix not in writers:
        raise ConfigError(f"movie: expected a file that ends in .gif or .mp4, found {target.name!r}")
    if not 0 < fps <= 100:
        raise ConfigError(f"fps: expected more than 0, at most 100, found {fps!r}")
    make_folder(target.parent)
    with name_in_os_errors(target), tempfile.TemporaryDirectory(dir=target.parent, prefix=PARTIAL) as folder:
        partial = Path(folder) / target.name
        writers[target.suffix](iter(pictures), partial, fps)
        partial.replace(target)


def _write_gif(pictures: Iterator[Image], path: Path, fps: float) -> None:
    from PIL import Image as Pillow

    palette = _palette()

    def frames() -> Iterator[Pillow.Image]:
        for image in pictures:
            frame = Pillow.fromarray(_numbers(image, palette))
            frame.putpalette(palette.tobytes())
            yield frame
        yield from [frame] * round(_HOLD_S * fps)  # equal pictures become one that is shown for longer

    first, *others = frames()
    first.save(
        path, save_all=True, append_images=others, duration=round(1000 / fps), loop=0, disposal=1, optimize=False
    )


def _numbers(image: Image, palette: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return the index of the nearest colour of a palette for each pixel (rows, cols)."""
    packed = image.astype(np.uint32) @ np.array([65536, 256, 1], np.uint32)
    values, inverse = np.unique(packed, return_inverse=True)
    colours = np.stack([values >> 16, values >> 8 & 255, values & 255], axis=1).astype(int)
    nearest = ((colours[:, None] - palette) ** 2).sum(axis=2).argmin(axis=1)
    return np.asarray(nearest[inverse].reshape(image.shape[:2]), np.uint8)


def _palette() -> npt.NDArray[np.uint8]:
    """Return the palette (n, 3): the colours of ``render``, their tints in the field of view, and mixtures of two."""
    ground = np.array(
        [render.FREE_COLOUR, render.UNKNOWN_COLOUR, render.HIDDEN_COLOUR, render.HIDDEN_THING_COLOUR], float
    )
    seen = ground + render.SIGHT * (np.array(render.ROBOT_COLOUR) - ground)
    walls = np.array([render.WALL_COLOUR, render.MASS_COLOUR, render.THING_COLOUR], float)
    ground = np.concatenate([ground, seen])
    drawn = np.array(
        [render.ROBOT_COLOUR, render.TRAIL_COLOUR, render.BODY_COLOUR, render.HIDDEN_BODY_COLOUR, render.GOAL_COLOUR],
        float,
    )
    blends = [
        under + share * (over - under)
        for under, over in itertools.product(np.concatenate([ground[[0, 1, 4]], walls[:1]]), drawn)
        for share in (0.25, 0.5, 0.75)
    ]
    return np.asarray(np.rint(np.concatenate([ground, walls, drawn, blends])), np.uint8)


def _write_mp4(pictures: Iterator[Image], path: Path, fps: float) -> None:
    import cv2

    first = next(pictures)
    size = first.shape[1] + first.shape[1] % 2, first.shape[0] + first.shape[0] % 2  # the codec needs even sizes
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
    if not writer.isOpened():
        raise MissingDependencyError(f"{path.name}: this build of OpenCV cannot write MP4; write a .gif")
    try:
        for image in itertools.chain([first], pictures):
            below, right = size[1] - image.shape[0], size[0] - image.shape[1]
            writer.write(np.pad(image, ((0, below), (0, right), (0, 0)), mode="edge")[..., ::-1])
    finally:
        writer.release()
