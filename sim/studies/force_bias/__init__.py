"""What the surveys of a string tell of the biases of its accelerometers."""
