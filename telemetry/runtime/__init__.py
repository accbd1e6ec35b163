"""What drives a process: steps from outside, or a clock of its own."""
