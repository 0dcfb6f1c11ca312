"""Scripts behind figures in the documentation: run with ``python -m research.<name>``, not part of the package."""
