"""Furniture for a finished plan: what a room of its label holds, placed by rules, doors and ways kept free."""

from pipeline.furnish.plan import furnished, is_chosen

__all__ = ["furnished", "is_chosen"]
