"""Compiled loops are there without SciPy's linear algebra, which works as ever for whoever wants it."""

import subprocess
import sys

PROGRAM = """
import sys
import numpy as np
from suave_des.world.pipeline import first_point_in_view
assert first_point_in_view(0.0, 0.0, 1.0, 3.0, np.zeros((1, 3))) == 0
assert "scipy.linalg" not in sys.modules
import numba
from scipy.linalg import solve
assert solve([[2.0]], [4.0]) == [2.0]
assert numba.njit(lambda a, b: np.dot(a, b))(np.eye(2), np.ones(2)).tolist() == [1.0, 1.0]
"""


def test_linear_algebra_is_loaded_only_by_who_wants_it() -> None:
    subprocess.run([sys.executable, "-c", PROGRAM], check=True)
