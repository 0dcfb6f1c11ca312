"""Entry point of the command line. It handles Ctrl-C from the start, even while other modules are being imported."""

from __future__ import annotations

import sys

from houseexpo.errors import INTERRUPTED


def main(*command: str) -> None:
    """Run the command line with ``command`` before the arguments (``python -m pipeline`` runs ``houseexpo build``)."""
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
