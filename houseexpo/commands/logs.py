"""How much the commands say: ``-q`` errors only and no progress bars, ``-v`` what is done, ``-vv`` all."""

from __future__ import annotations

import logging
import sys

OURS = ("houseexpo", "pipeline", "stats")


def set_up(verbose: int, *, quiet: bool) -> None:
    """Send what our packages log to standard error, from WARNING on, or as was asked."""
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
    for name in OURS:
        logger = logging.getLogger(name)
        logger.setLevel(level)
        logger.handlers[:] = [handler]
        logger.propagate = False
