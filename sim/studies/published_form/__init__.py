"""The published form of the filter, as a kernel of its own for the published experiments."""
