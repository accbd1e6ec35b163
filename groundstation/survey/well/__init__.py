"""The hole: trajectory, reference frames, error propagation, clearance."""
