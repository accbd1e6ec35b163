"""What the ground station keeps in its database, and goes on with after a start."""
