"""Allan analysis of synthetic records."""
