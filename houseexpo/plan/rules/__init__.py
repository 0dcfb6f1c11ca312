"""The rules of the format that a schema cannot express. Each is a function that yields a plan's violations."""
