"""PseudoSLAM: a simulated robot in a floor plan, and the map that a SLAM would have made of what it saw."""
