"""A judged hole of two stations whose numbers all differ."""

import numpy as np

from borechain.studies.judged_hole import JudgedHole

COV = np.array([[[4.0, 0.0], [0.0, 9.0]], [[1.0, 0.0], [0.0, 16.0]]])
PLACES = np.array([np.diag([1.0, 4.0, 9.0]), np.diag([25.0, 16.0, 4.0])])
HOLE = JudgedHole(
    np.array([2.0, 4.0]), np.array([[2.0, 6.0], [0.5, 4.0]]), COV, np.array([[1.0, 2.0, 6.0], [5.0, 8.0, 2.0]]), PLACES
)
