"""Run the command ``houseexpo build`` when called as ``python -m pipeline``."""

from houseexpo.entry import main

main("build")
