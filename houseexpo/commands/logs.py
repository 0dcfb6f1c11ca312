"""Verbosity of the commands: ``-q`` only errors and no progress bars, ``-v`` each action, ``-vv`` everything."""

from __future__ import annotations

import logging
import sys

OURS = ("houseexpo", "pipeline", "stats")


def set_up(verbose: int, *, quiet: bool) -> None:
    """Send the log messages of our packages to standard error, by default from WARNING on."""
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
    for name in OURS:
        logger = logging.getLogger(name)
        logger.setLevel(level)
        logger.handlers[:] = [handler]
        logger.propagate = False
