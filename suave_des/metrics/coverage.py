"""The area of the sea bed that the camera has seen."""

import math

import numpy as np
from numpy.typing import NDArray

from suave_des.compiling import Array, compiled

CELL_M = 0.1
_ROW_STEP = 4
"""Only every fourth row of the track is used: the area is at most 1% smaller, in a quarter of the time."""
_MAX_CELLS = 4_000_000
"""At most 4 MB: 40,000 m2 in cells of 0.1 m."""


def covered_area_m2(track: Array, last_row: int, visibility_m: Array, sea_bed_z_m: float, view_tangent: float) -> float:
    """Measure the area of the sea bed that the camera, looking straight down, has seen at least once.

    A place is seen when it is in view, and the camera's height above it is at most the water visibility. Areas are
    counted in squares of 0.1 m, larger ones for very long tracks.

    Args:
        track: positions x, y, z in the first three columns, shape (rows, at least 3), m.
        last_row: the last row that counts.
        visibility_m: measured water visibility at each row, shape (rows,); nan while there is no measurement.
        sea_bed_z_m: height of the sea bed.
        view_tangent: tangent of half the camera's field of view.
    """
    rows = track[: last_row + 1 : _ROW_STEP, :3]
    height_m = rows[:, 2] - sea_bed_z_m
    seen = rows[height_m <= visibility_m[: last_row + 1 : _ROW_STEP]]
    if len(seen) == 0:
        return 0.0
    half_m = (seen[:, 2] - sea_bed_z_m) * view_tangent
    low = (seen[:, :2] - half_m[:, None]).min(axis=0)
    size = (seen[:, :2] + half_m[:, None]).max(axis=0) - low
    cell_m = max(CELL_M, math.sqrt(size[0] * size[1] / _MAX_CELLS))
    grid = np.zeros((int(size[0] / cell_m) + 2, int(size[1] / cell_m) + 2), dtype=np.uint8)
    return _mark(seen, half_m, (float(low[0]), float(low[1])), cell_m, grid) * cell_m * cell_m


@compiled
def _mark(seen: Array, half_m: Array, low: tuple[float, float], cell_m: float, grid: NDArray[np.uint8]) -> int:
    """Mark the cells whose centre is in view from each place; return how many there are."""
    count = 0
    for row in range(seen.shape[0]):
        first_x = math.ceil((seen[row, 0] - half_m[row] - low[0]) / cell_m - 0.5)
        last_x = math.floor((seen[row, 0] + half_m[row] - low[0]) / cell_m - 0.5)
        first_y = math.ceil((seen[row, 1] - half_m[row] - low[1]) / cell_m - 0.5)
        last_y = math.floor((seen[row, 1] + half_m[row] - low[1]) / cell_m - 0.5)
        for i in range(max(first_x, 0), min(last_x + 1, grid.shape[0])):
            for j in range(max(first_y, 0), min(last_y + 1, grid.shape[1])):
                if grid[i, j] == 0:
                    grid[i, j] = 1
                    count += 1
    return count
