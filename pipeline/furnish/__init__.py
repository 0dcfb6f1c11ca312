"""Furnish a finished plan: rules choose furniture by room label and place it, so that doors and ways stay free."""

from pipeline.furnish.plan import furnish_plan, is_chosen

__all__ = ["furnish_plan", "is_chosen"]
