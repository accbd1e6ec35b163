"""Kernels as the Python that they are, for a process without numba: it imports nothing else of the node."""
