"""Commands that run the ground station or ask it."""
