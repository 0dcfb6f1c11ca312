"""From 3D houses to floor plans: the paper's Algorithm 1, on real input."""
