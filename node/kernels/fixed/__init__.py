"""The node's loop in integers: the same functions as the float64 kernels, on records of integers."""
