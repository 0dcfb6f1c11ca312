"""From triangles to the storeys of a house: surfaces, units and up axis, floors and ceilings."""
