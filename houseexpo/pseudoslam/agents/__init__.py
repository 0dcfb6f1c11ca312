"""Agents: policies, frontier explorers, and driving by hand."""
