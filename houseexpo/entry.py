"""Where the command starts: it answers Ctrl-C from its first moment on, while all else is still being imported."""

from __future__ import annotations

import sys

from houseexpo.errors import INTERRUPTED


def main(*command: str) -> None:
    """Run the command line; ``command`` is put before the arguments (``python -m pipeline`` is ``houseexpo build``)."""
    try:
        from houseexpo.commands.app import main as run

        run(*command)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)
    finally:
        # After a Ctrl-C that left an exec() of a string (dataclasses make some while they are imported), CPython's
        # `python -m` ends by the signal, whatever the exit code is. The next exec() of a string makes it forget.
        exec("")  # noqa: S102
