"""Compile what most tests would compile, each worker for itself: nodes' kernels, string of the studies, surveys."""

import borechain.warm_all
from groundstation.survey.compiled_model import warm
from sim.studies.lab import LAB, run_seed

if __name__ == "__main__":
    run_seed((LAB, 1))
    warm()

__all__ = ["borechain"]
