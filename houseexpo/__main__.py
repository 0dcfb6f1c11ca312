"""Entry point of ``python -m houseexpo``, which is the same as the command ``houseexpo``."""

from houseexpo.entry import main

main()
