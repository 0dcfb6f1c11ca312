"""Show pictures in a window and return the keys pressed there, with the optional library pygame."""

from __future__ import annotations

import os
from types import TracebackType
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, MissingDependencyError, install_command

_UNSEEN: Final = ("dummy", "offscreen")
"""What SDL falls back to where there is no display: nobody would see such a window, and no key would reach it."""


class Window:
    """A window, which opens with the first picture.

    Raises
    ------
    MissingDependencyError
        pygame is not installed.
    """

    most_px = (1200, 800)
    """Largest width and height of pictures, pixels."""

    def __init__(self, title: str) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise MissingDependencyError(f"a window needs pygame: {install_command('play')}") from error
        self._pygame, self._title = pygame, title
        self._clock = pygame.time.Clock()
        self._screen: pygame.Surface | None = None

    def __enter__(self) -> Window:
        """Return the window, which is closed when the context ends."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self.close()

    def show(self, image: npt.NDArray[np.uint8], caption: str = "", fps: float = 0.0) -> None:
        """Show a picture (rows, cols, 3), at most ``fps`` per second (0 for no limit)."""
        pygame, size = self._pygame, image.shape[1::-1]
        if self._screen is None or self._screen.get_size() != size:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
        pygame.display.set_caption(caption or self._title)
        self._screen.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        if fps > 0:
            self._clock.tick(fps)

    def keys(self, wait_s: float) -> list[str]:
        """Return the names of pressed keys, such as "up" or "q", after waiting for one; "q" if the window is closed.

        Raises
        ------
        ConfigError
            There is no display, so no key will come, and SDL_VIDEODRIVER does not ask for such a window.
        """
        pygame = self._pygame
        if pygame.display.get_driver() in _UNSEEN and "SDL_VIDEODRIVER" not in os.environ:
            raise ConfigError(
                "window: expected a display, found none; start it on a desktop, or set DISPLAY or WAYLAND_DISPLAY"
            )
        first = pygame.event.wait(round(1000 * wait_s))
        return [
            "q" if event.type == pygame.QUIT else pygame.key.name(event.key)
            for event in [first, *pygame.event.get()]
            if event.type in (pygame.QUIT, pygame.KEYDOWN)
        ]

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
        self._screen = None
