"""Try the claims of the pages: ``python -m tests.claims``."""
