"""Mesh files into named triangles: one module a format, and the scene that they fill."""
