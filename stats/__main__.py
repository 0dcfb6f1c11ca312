"""``python -m stats`` is ``houseexpo stats``."""

from houseexpo.commands.app import main

main("stats")
