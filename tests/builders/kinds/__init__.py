"""A kit of kinds: random houses of each kind in which houses are published, with the truth they were made from."""
