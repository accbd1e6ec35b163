"""What every answer of the ground station holds: one class an answer, its fields with their meanings."""
