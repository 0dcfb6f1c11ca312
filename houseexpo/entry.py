"""Run the command ``houseexpo``: keep the working directory off the import path, and exit with 130 on Ctrl-C.

Ctrl-C is handled from the start, even while other modules are being imported.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

from houseexpo.errors import INTERRUPTED


def remove_working_directory() -> None:
    """Take the working directory from the import path, where ``python -m`` puts it first.

    A ``typer.py`` in a downloaded folder would be run. The folder of our own packages stays.
    """
    with suppress(OSError):  # a working directory that was removed
        here, home = Path.cwd(), Path(__file__).resolve().parents[1]
        if not sys.flags.safe_path and sys.path[:1] in ([""], [str(here)]) and here != home:
            del sys.path[0]


def main(*command: str) -> None:
    """Run the command line with ``command`` before the arguments (``python -m pipeline`` runs ``houseexpo build``)."""
    remove_working_directory()
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
