"""Sound homes, in which one could live: a programme of rooms, a hall, bands of rooms along it, doors and windows."""
