"""Faults of a rig drawn from one integer."""
