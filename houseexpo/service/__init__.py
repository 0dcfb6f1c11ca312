"""Serve data sets over HTTP, as pages for people and as an interface for programs (``houseexpo serve``).

``app.make_app(service)`` makes the application of a ``Service``: the data sets shown, by name, and the settings. Each
area (pages, the API, the review, drives) is a module or package with ``routes(service)``; ``app`` gathers them from one
tuple. What guards all of them is in ``guard``.
"""
