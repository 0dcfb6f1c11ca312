"""A batch: what is done, where it is kept, what came of it."""
