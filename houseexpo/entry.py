"""Where the command starts: it answers Ctrl-C from its first moment on, while all else is still being imported."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main(*command: str) -> None:
    """Run the command line; ``command`` is put before the arguments (``python -m pipeline`` is ``houseexpo build``)."""
    try:
        from houseexpo.commands.app import main as run

        run(*command)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)
