"""Run the command ``houseexpo stats`` when called as ``python -m stats``."""

from houseexpo.entry import main

main("stats")
