"""The firmware of one node of the drill string."""

__distribution__ = "borechain"  # what packages of the same name do not have
