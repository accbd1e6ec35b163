"""What each ingredient of the filter buys."""
