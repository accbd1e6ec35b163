"""The firmware of one node of the drill string."""
