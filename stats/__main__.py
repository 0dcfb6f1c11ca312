"""Entry point of ``python -m stats``, which is the same as ``houseexpo stats``."""

from houseexpo.commands.app import main

main("stats")
