"""The memory of a node as records of flat bytes, in floats and in integers."""
