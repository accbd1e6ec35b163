"""The world that nodes and ground station cannot tell from the real one, and the launcher of a whole rig."""

__distribution__ = "borechain"  # what packages of the same name do not have
