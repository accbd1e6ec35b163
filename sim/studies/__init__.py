"""Published experiments, ours beside the printed values."""
