"""Survey mathematics that is compiled: kernels see numpy, numba and math, and the caller owns every array."""
