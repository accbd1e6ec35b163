"""How often the claimed ellipse holds the true position."""
