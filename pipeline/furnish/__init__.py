"""Furnish a finished plan: rules choose furniture by room label and place it, so that doors and ways stay free."""

from pipeline.furnish.plan import furnished, is_chosen

__all__ = ["furnished", "is_chosen"]
