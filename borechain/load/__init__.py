"""Load for a real ground station: a string that speaks for all its tubes, readers, and one that kills it."""
