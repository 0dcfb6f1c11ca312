"""Robots that act: by policies, towards frontiers, or driven by hand."""
