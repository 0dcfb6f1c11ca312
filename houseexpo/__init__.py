"""HouseExpo: 2D floor plans for robots that learn.

``__init__.pyi`` lists the public names. Each one is imported when it is first used, so that ``import houseexpo`` is
fast.

Examples
--------
>>> import houseexpo
>>> houseexpo.canonical("living room")
'Living_Room'
"""

import os
import sys


def _leave_working_directory() -> None:
    """Take the working directory from the import path, where ``python -m houseexpo`` has just put it first.

    A ``threading.py`` in a downloaded folder would be run by the next import. The folder of our own packages stays.
    """
    words = sys.orig_argv
    started = {name for option, name in zip(words, words[1:], strict=False) if option == "-m"}  # noqa: RUF007
    if sys.flags.safe_path or not started & {"houseexpo", "pipeline", "stats"}:
        return
    home = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))  # noqa: PTH120 - pathlib may be a trap
    try:
        here = os.path.realpath(sys.path[0] or os.getcwd())  # noqa: PTH109
    except OSError:  # a working directory that was removed
        here = ""
    if here != home:
        del sys.path[0]


_leave_working_directory()

import lazy_loader  # noqa: E402

__version__ = "0.3.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
