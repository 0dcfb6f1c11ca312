"""Show pictures in a terminal, two pixels per character, read keys at once, and restore its former state at the end."""

from __future__ import annotations

import itertools
import os
import re
import select
import shutil
import signal
import sys
from types import FrameType, TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.render.canvas import Image

_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l\x1b[2J", "\x1b[0m\x1b[?25h\x1b[?1049l"  # the alternate screen, without a cursor
_KEY = re.compile(r"\x1b[\[O]([ABCD])|\x1b.?|(.)", re.DOTALL)
_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
_ENDINGS = signal.SIGTERM, signal.SIGHUP, signal.SIGINT
_WORDS = 2  # lines below the picture
_LEVELS = (0, 95, 135, 175, 215, 255)
_TABLE = np.concatenate(
    [np.array(list(itertools.product(_LEVELS, repeat=3))), np.arange(8, 248, 10)[:, None].repeat(3, axis=1)]
)  # colours 16 to 255 of terminals that have 256


class Terminal:
    """A context manager that takes over the terminal and always restores its former state.

    Raises
    ------
    ConfigError
        Input and output are not a terminal, or the system does not support this.
    """

    def __init__(self) -> None:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            raise ConfigError(
                "play: expected a terminal for input and output, found none; run it in a terminal, or drive in the "
                "browser: houseexpo serve"
            )
        try:
            import termios
        except ImportError as error:
            raise ConfigError("play: this system's terminals are not supported; use houseexpo serve") from error
        self._termios, self._in = termios, sys.stdin.fileno()
        self._many = os.environ.get("COLORTERM") in {"truecolor", "24bit"}
        self._before: list[Any] = []
        self._handlers: dict[signal.Signals, Any] = {}
        self._ending: BaseException | None = None

    def __enter__(self) -> Terminal:
        """Switch to the alternate screen and to immediate keys."""
        termios = self._termios
        self._before = termios.tcgetattr(self._in)
        ours = termios.tcgetattr(self._in)
        ours[3] &= ~(termios.ICANON | termios.ECHO)
        ours[6][termios.VSUSP] = b"\0"  # no suspending with the terminal in this state
        self._handlers = {ending: signal.signal(ending, self._end) for ending in _ENDINGS}
        termios.tcsetattr(self._in, termios.TCSADRAIN, ours)
        self._write(_ENTER)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the terminal."""
        try:
            self._write(_LEAVE)
        finally:
            self._termios.tcsetattr(self._in, self._termios.TCSAFLUSH, self._before)
            for ending, handler in self._handlers.items():
                signal.signal(ending, handler)

    @property
    def most_px(self) -> tuple[int, int]:
        """Return the current largest width and height of a picture, pixels."""
        columns, lines = shutil.get_terminal_size()
        return max(columns, 1), max(2 * (lines - _WORDS), 2)

    def show(self, image: Image, caption: str = "") -> None:
        """Show a picture (rows, cols, 3) not larger than ``most_px``, and a caption below it."""
        columns, _ = shutil.get_terminal_size()
        indent = " " * ((columns - image.shape[1]) // 2)
        lines = [indent + line for line in half_blocks(image, many=self._many)]
        lines += [line[:columns] for line in caption.split("\n")[:_WORDS]]
        self._write("\x1b[H" + "\x1b[K\n".join(lines) + "\x1b[J")

    def keys(self, wait_s: float) -> list[str]:
        """Return the pressed keys, such as "up" or "q", after waiting for one; "q" if the terminal is gone."""
        if self._ending is not None:
            raise self._ending
        if not select.select([self._in], [], [], wait_s)[0]:
            return []
        typed = os.read(self._in, 4096)
        if not typed:
            return ["q"]
        found = (_ARROWS.get(arrow, other) for arrow, other in _KEY.findall(typed.decode(errors="ignore")))
        return [key for key in found if key]

    def _end(self, number: int, _: FrameType | None) -> None:
        """End the context; an exception in a finaliser would be lost, so that ``keys`` raises it again."""
        self._ending = KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
        raise self._ending

    def _write(self, words: str) -> None:
        sys.stdout.write(words)
        sys.stdout.flush()


def half_blocks(image: Image, *, many: bool) -> list[str]:
    """Return a picture (rows, cols, 3) as lines of text with two rows of pixels each.

    With ``many``, it has 16 million colours, otherwise 256.
    """
    if len(image) % 2:
        image = np.concatenate([image, np.zeros_like(image[:1])])
    colours, numbers = np.unique(image.reshape(-1, 3), axis=0, return_inverse=True)
    names = [f"2;{r};{g};{b}" for r, g, b in colours.tolist()] if many else [f"5;{n}" for n in _nearest(colours)]
    cells = numbers.reshape(len(image) // 2, 2, -1)
    lines = []
    for above, below in cells.tolist():
        parts, last = [], (-1, -1)
        for pair in zip(above, below, strict=True):
            if pair != last:
                parts.append(f"\x1b[38;{names[pair[0]]};48;{names[pair[1]]}m")
                last = pair
            parts.append("▀")
        lines.append("".join(parts) + "\x1b[0m")
    return lines


def _nearest(colours: npt.NDArray[np.uint8]) -> list[int]:
    away = ((colours[:, None].astype(int) - _TABLE) ** 2).sum(axis=2)
    return [16 + int(number) for number in away.argmin(axis=1)]
