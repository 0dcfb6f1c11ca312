"""Entry point of ``python -m stats``, which is the same as ``houseexpo stats``."""

from houseexpo.entry import main

main("stats")
