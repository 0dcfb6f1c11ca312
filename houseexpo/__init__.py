"""HouseExpo: 2D floor plans for robots that learn."""
