"""HouseExpo: 2D floor plans for robots that learn.

``__init__.pyi`` lists the public names. Each one is imported when it is first used, so that ``import houseexpo`` is
fast.

Examples
--------
>>> import houseexpo
>>> houseexpo.canonical("living room")
'Living_Room'
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
