"""Numbers of kernels in two forms: floats and integers, quantities, angles, and how they are compiled."""
