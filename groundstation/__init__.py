"""The ground station: the only thing an operator talks to."""

__distribution__ = "borechain"  # what packages of the same name do not have
