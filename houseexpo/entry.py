"""Run the command ``houseexpo``: keep the working directory off the import path, and exit with 130 on Ctrl-C.

Ctrl-C is handled from the start, even while other modules are being imported.
"""

from __future__ import annotations

import os
import sys

from houseexpo.errors import INTERRUPTED


def main(*command: str) -> None:
    """Run the command line with ``command`` before the arguments (``python -m pipeline`` runs ``houseexpo build``)."""
    # also for processes that libraries start; what a script of a user's starts is the script's own business
    os.environ["PYTHONSAFEPATH"] = "1"  # houseexpo.processes.SAFE_PATH
    try:
        from houseexpo.commands.app import main as run

        run(*command)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)
    finally:
        # If Ctrl-C interrupts the exec() of a string (dataclasses run some at import time), CPython's `python -m` later
        # dies from the signal and ignores the exit code. Another exec() of a string clears that state.
        exec("")  # noqa: S102
