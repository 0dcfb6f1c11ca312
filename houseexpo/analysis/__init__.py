"""Measurements on plans: room graph, walking distances, navigability, walls, similarity to other plans."""
