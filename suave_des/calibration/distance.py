"""How far simulated runs are from published ones: energy distances between distributions, summed over managers.

The energy distance between the distributions of X and Y is 2 E|X - Y| - E|X - X'| - E|Y - Y'| (Székely and Rizzo,
2013); it is zero only if they are equal, needs no bins, and takes vectors. A mission is the vector of its search time,
its distance inspected and the x of the pipeline point it saw first, each divided by a scale, so that which values come
together counts, not only how often each comes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SCALES = (40.0, 12.0, 1.5)
"""Search time in s, distance in m, detection x in m: about the published standard deviations within a manager."""


def energy_distance(x: Array, y: Array) -> float:
    """Energy distance between two samples of vectors, shapes (n, d) and (m, d); a component that is nan in either
    vector of a pair is left out, and the others count for it.
    """
    return 2.0 * _mean_distance(x, y) - _mean_distance(x, x) - _mean_distance(y, y)


def _mean_distance(x: Array, y: Array) -> float:
    difference = x[:, None, :] - y[None, :, :]
    known = ~np.isnan(difference)
    squares = np.where(known, difference, 0.0) ** 2
    share = known.mean(axis=2)
    return float(np.sqrt(squares.sum(axis=2) / share).mean())


def missions_as_vectors(search_time_s: Array, distance_m: Array, detection_x_m: Array) -> Array:
    """Missions as scaled vectors, shape (n, 3); unknown components are nan."""
    vectors: Array = np.column_stack([search_time_s, distance_m, detection_x_m]) / np.array(SCALES)
    return vectors
