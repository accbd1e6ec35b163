"""The kernels in integers as one C99 file: from their own source, so that a chip runs what the simulator does."""
