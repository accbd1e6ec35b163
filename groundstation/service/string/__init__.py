"""The drill string as the ground station knows it: tubes, what they say, where the bit was and stood. No I/O."""
