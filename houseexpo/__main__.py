"""``python -m houseexpo`` is the command ``houseexpo``."""

from houseexpo.cli import main

main()
