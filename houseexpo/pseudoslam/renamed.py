"""Former names of attributes, which still work but give a warning."""

from __future__ import annotations

import warnings
from typing import Any


def renamed(old: str, new: str) -> Any:  # a property, for an attribute of any type
    """Return a property ``old`` that returns the attribute ``new`` with a DeprecationWarning."""

    def get(self: object) -> Any:
        warnings.warn(f"{type(self).__name__}.{old} is called {new}", DeprecationWarning, stacklevel=2)
        return getattr(self, new)

    get.__doc__ = f"``{new}``, by its old name."
    return property(get)
