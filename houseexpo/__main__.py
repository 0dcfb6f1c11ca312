"""``python -m houseexpo`` is the command ``houseexpo``."""

from houseexpo.entry import main

main()
