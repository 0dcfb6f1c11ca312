"""Furnish a finished plan: rules choose furniture by room label and place it, so that doors and ways stay free."""

from pipeline.furnish.plan import draw_whether_furnished, furnish_plan

__all__ = ["draw_whether_furnished", "furnish_plan"]
