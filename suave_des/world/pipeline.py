"""The pipeline, and the mock-up of its detection: which of its points a downward camera sees (facts: kas-lab/suave)."""

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from suave_des.compiling import compiled
from suave_des.domain import SEA_BED_Z_M as SEA_BED_Z_M
from suave_des.domain import SURFACE_Z_M as SURFACE_Z_M

Array = NDArray[np.float64]
FIELD_OF_VIEW_RAD = math.radians(60.0)
VIEW_TANGENT = math.tan(FIELD_OF_VIEW_RAD / 2.0)


@cache
def sample_points(vertices_m: tuple[tuple[float, float, float], ...], points_per_piece: int = 20) -> Array:
    """Points along the pipeline, shape (pieces * points_per_piece, 3), in m.

    Each straight piece gives evenly spaced points, its first vertex excluded and its last included.
    """
    vertices = np.array(vertices_m, dtype=np.float64)
    share = np.arange(1, points_per_piece + 1) / points_per_piece
    pieces = [a + share[:, None] * (b - a) for a, b in pairwise(vertices)]
    points = np.concatenate(pieces)
    points.flags.writeable = False
    return points


def there_and_back(points: Array) -> Array:
    """The way along all points, shape (n, at least 2), and back: x and y in m, shape (2 n, 2).

    From its element i on it is the way to follow when point i is seen first: on to the far end, then back along all.
    """
    return np.concatenate((points[:, :2], points[::-1, :2]))


@compiled
def first_point_in_view(x_m: float, y_m: float, z_m: float, visibility_m: float, points: Array) -> int:
    """Lowest index of the points that a camera at (x, y, z) sees, -1 if none.

    With h the vertical distance to a point, the point is in view within h * tan(field of view / 2) in x and in y, and
    visible if h is at most the water visibility.
    """
    for index in range(points.shape[0]):
        h = abs(z_m - points[index, 2])
        d = h * VIEW_TANGENT
        if abs(y_m - points[index, 1]) <= d and abs(x_m - points[index, 0]) <= d and h <= visibility_m:
            return index
    return -1


@compiled
def first_detection(
    track: Array,
    first_row: int,
    last_row: int,
    visibility_m: Array,
    points: Array,
) -> tuple[int, int]:
    """First row of [first_row, last_row] from which a point is seen, and the point's index; (-1, -1) if none.

    Args:
        track: positions x, y, z in the first three columns, shape (rows, at least 3), m.
        first_row: first row to look at.
        last_row: last row to look at.
        visibility_m: measured water visibility at each row, shape (rows,); nan while there is no measurement.
        points: points as the detection places them, shape (n, 3), m.
    """
    low_x, high_x, low_y, high_y, low_z = np.inf, -np.inf, np.inf, -np.inf, np.inf
    high_z = -np.inf
    for index in range(points.shape[0]):
        low_x, high_x = min(low_x, points[index, 0]), max(high_x, points[index, 0])
        low_y, high_y = min(low_y, points[index, 1]), max(high_y, points[index, 1])
        low_z, high_z = min(low_z, points[index, 2]), max(high_z, points[index, 2])
    for row in range(first_row, last_row + 1):
        x, y, z = track[row, 0], track[row, 1], track[row, 2]
        # Far from the pipeline's bounding box no point can be in view: most rows of a search end here.
        widest = max(abs(z - low_z), abs(z - high_z)) * VIEW_TANGENT
        if x < low_x - widest or x > high_x + widest or y < low_y - widest or y > high_y + widest:
            continue
        index = first_point_in_view(x, y, z, visibility_m[row], points)
        if index >= 0:
            return row, index
    return -1, -1
