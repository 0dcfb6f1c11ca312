"""Where houses come from: each reader yields the levels of a house."""
