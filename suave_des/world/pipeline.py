"""The pipeline, and the mock-up of its detection: which of its points a downward camera sees.

Source: the pipeline detection of kas-lab/suave, of 4 February 2023 and of 1.5.0; the paper, section
on the mission.
"""

from functools import cache
from itertools import pairwise

import numpy as np

from suave_des.compiling import Array, Record, compiled, record


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


@record
class CameraRecord(Record):
    """What the camera looks for, and how far it has looked.

    The bounds are the least and the greatest coordinates of the points as the detection places
    them.
    """

    is_open: bool  # until a point is seen
    tangent: float  # of half the camera's field of view
    low_x_m: float
    low_y_m: float
    low_z_m: float
    high_x_m: float
    high_y_m: float
    high_z_m: float
    next_row: int  # of the track, that is to be looked at
    measured: int  # how many measurements of the visibility there are by then
    point: int  # index of the point that is seen first


@compiled
def first_detection(
    camera: CameraRecord, track: Array, last: int, row_s: float, visibility: Array, points: Array
) -> bool:
    """Look from the rows of a track up to `last` for a point; stop at the first row from which one
    is seen.

    Args:
        camera: closed once a point is seen; `next_row` becomes the row from which the point is seen, or that after the last.
        track: positions x, y, z in the first three columns, shape (rows, at least 3), m.
        row_s: time between rows.
        visibility: measured water visibility: the times, s, ascending, of the values, m, shape
            (2, n); none before the first one.
        points: points as the detection places them, shape (n, 3), m.

    Returns:
        Whether a point is seen.
    """
    if not camera.is_open:
        return False
    low_z, high_z, tangent = camera.low_z_m, camera.high_z_m, camera.tangent
    for row in range(camera.next_row, last + 1):
        x, y, z = track[row, 0], track[row, 1], track[row, 2]
        # Far from the pipeline's bounding box no point can be in view: most rows of a search end
        # here.
        widest = max(abs(z - low_z), abs(z - high_z)) * tangent
        if x < camera.low_x_m - widest or x > camera.high_x_m + widest:
            continue
        if y < camera.low_y_m - widest or y > camera.high_y_m + widest:
            continue
        while (
            camera.measured < visibility.shape[1]
            and np.rint(visibility[0, camera.measured] / row_s) <= row
        ):
            camera.measured += 1
        if camera.measured > 0:
            visibility_m = visibility[1, camera.measured - 1]
            camera.point = first_point_in_view(x, y, z, visibility_m, points, tangent)
            if camera.point >= 0:
                camera.next_row, camera.is_open = row, False
                return True
    camera.next_row = last + 1
    return False
