"""What the ground station runs: store, state, queries."""
