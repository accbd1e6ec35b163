"""The path of a hole between and beyond its stations: a curvature that wanders, and where that leads. No I/O."""
