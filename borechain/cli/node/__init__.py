"""Commands that run one node."""
