"""The pipeline, and the mock-up of its detection: which of its points a downward camera sees.

Source: the pipeline detection of kas-lab/suave, of 4 February 2023 and of 1.5.0; the paper, section
on the mission.
"""

from functools import cache
from itertools import pairwise

import numpy as np

from suave_des.compiling import Array, compiled


@cache
def sample_points(
    vertices_m: tuple[tuple[float, float, float], ...], points_per_piece: int = 20
) -> Array:
    """Sample points along the pipeline, shape (pieces * points_per_piece, 3), in m.

    Each straight piece gives evenly spaced points, its first vertex excluded and its last included.
    """
    share = np.arange(1, points_per_piece + 1)[:, None] / points_per_piece
    points = np.concatenate([a + share * (b - a) for a, b in pairwise(np.array(vertices_m))])
    points.flags.writeable = False
    return points


@compiled
def first_point_in_view(
    x_m: float, y_m: float, z_m: float, visibility_m: float, points: Array, view_tangent: float
) -> int:
    """Find the lowest index of the points that a camera at (x, y, z) sees, -1 if none.

    With h the vertical distance to a point, the point is in view within h * tan(field of view / 2)
    in x and in y, and visible if h is at most the water visibility. `view_tangent` is the tangent
    of half the field of view.
    """
    for index in range(points.shape[0]):
        h = abs(z_m - points[index, 2])
        d = h * view_tangent
        if (
            abs(y_m - points[index, 1]) <= d
            and abs(x_m - points[index, 0]) <= d
            and h <= visibility_m
        ):
            return index
    return -1


@compiled
def first_detection(
    track: Array,
    rows: tuple[int, int],
    row_s: float,
    visibility: tuple[Array, Array],
    points: Array,
    bounds_m: tuple[tuple[float, float, float], tuple[float, float, float]],
    view_tangent: float,
) -> tuple[int, int]:
    """Find the first row from which a point is seen, and the point's index; (-1, -1) if none.

    Args:
        track: positions x, y, z in the first three columns, shape (rows, at least 3), m.
        rows: the first and the last row that count.
        row_s: time between rows.
        visibility: measured water visibility: the times, s, ascending, of the values, m; none
            before the first one.
        points, bounds_m: points as the detection places them, shape (n, 3), m; the least and the
        greatest coordinates.
        view_tangent: tangent of half the camera's field of view.
    """
    (low_x, low_y, low_z), (high_x, high_y, high_z) = (
        bounds_m  # finding them here would take 2 s to compile
    )
    (times_s, visibility_m), measured = visibility, 0
    for row in range(rows[0], rows[1] + 1):
        x, y, z = track[row, 0], track[row, 1], track[row, 2]
        # Far from the pipeline's bounding box no point can be in view: most rows of a search end
        # here.
        widest = max(abs(z - low_z), abs(z - high_z)) * view_tangent
        if x < low_x - widest or x > high_x + widest or y < low_y - widest or y > high_y + widest:
            continue
        while measured < times_s.shape[0] and np.rint(times_s[measured] / row_s) <= row:
            measured += 1
        if measured > 0:
            index = first_point_in_view(x, y, z, visibility_m[measured - 1], points, view_tangent)
            if index >= 0:
                return row, index
    return -1, -1
