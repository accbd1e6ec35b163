"""Compile what most tests would compile, each worker for itself: the nodes' kernels, and the string of the studies."""

import borechain.warm_all
from sim.studies.lab import LAB, run_seed

if __name__ == "__main__":
    run_seed((LAB, 1))

__all__ = ["borechain"]
