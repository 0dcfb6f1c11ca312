"""``python -m pipeline`` is ``houseexpo build``."""

from houseexpo.cli import main

main("build")
