"""Ways to map a function over ids."""
