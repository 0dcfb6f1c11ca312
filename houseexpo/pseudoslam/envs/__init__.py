"""Environments for gymnasium and Stable-Baselines3: one robot (``single``) or many (``vector``)."""
