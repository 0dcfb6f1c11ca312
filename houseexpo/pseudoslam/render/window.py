"""A window that shows pictures and hears keys; pygame is an optional extra."""

from __future__ import annotations

import os
from types import TracebackType

import numpy as np
import numpy.typing as npt

from houseexpo.errors import MissingDependencyError, installing


class Window:
    """A window; it opens with the first picture.

    Raises
    ------
    MissingDependencyError
        Where there is no pygame.
    """

    most_px = (1200, 800)
    """How wide and high pictures should be at most."""

    def __init__(self, title: str) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise MissingDependencyError(f"a window needs pygame: {installing('play')}") from error
        self._pygame, self._title = pygame, title
        self._clock = pygame.time.Clock()
        self._screen: pygame.Surface | None = None

    def __enter__(self) -> Window:
        """Close it at the end of a ``with`` block."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self.close()

    def show(self, image: npt.NDArray[np.uint8], caption: str = "", fps: float = 0.0) -> None:
        """Show a picture (rows, cols, 3), not sooner after the last than ``fps`` allows (0: at once)."""
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
        """Return the names of the keys pressed, "up" or "q", waiting so long for one; "q", too, where it is closed."""
        pygame = self._pygame
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
