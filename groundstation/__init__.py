"""The ground station: the only thing an operator talks to."""
