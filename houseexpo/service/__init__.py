"""The data service: a data set as pages to walk through and as an interface for programs (``houseexpo serve``).

``app.make_app(service)`` makes the application of a ``Service``: the data sets shown, by name, and the settings. Each
area (gallery, plan, refused, statistics, api, review, drive) is a module or package with ``routes(service)``; ``app``
gathers them from one tuple. What guards all of them stands in ``safety``.
"""
