"""Pictures of an episode: in a window, in a terminal, or as arrays."""
