"""Show pictures in a window, with the optional library pygame."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from houseexpo.errors import MissingDependencyError, install_command


class PictureWindow:
    """A window, which opens with the first picture.

    Raises
    ------
    MissingDependencyError
        pygame is not installed.
    """

    def __init__(self, title: str) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise MissingDependencyError(f"a window needs pygame: {install_command('play')}") from error
        self._pygame, self._title = pygame, title
        self._clock = pygame.time.Clock()
        self._screen: pygame.Surface | None = None

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

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
        self._screen = None
