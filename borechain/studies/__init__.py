"""Studies of whole rigs: a string of real firmware in a drawn world, and the ground station that judges its hole."""
