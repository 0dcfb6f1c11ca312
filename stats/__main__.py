"""``python -m stats`` is ``houseexpo stats``."""

from houseexpo.cli import main

main("stats")
