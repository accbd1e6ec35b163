"""The doors of the ground station: each medium an operator may come in by."""
