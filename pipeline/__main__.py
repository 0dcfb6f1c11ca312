"""``python -m pipeline`` is ``houseexpo build``."""

from houseexpo.entry import main

main("build")
