"""The search for the first row with a point in view agrees with looking at each row and point."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from suave_des.compiling import shared
from suave_des.scenario.models import Pipeline
from suave_des.world.pipeline import (
    CameraRecord,
    first_detection,
    first_point_in_view,
    sample_points,
)

POINTS = sample_points(Pipeline().vertices_m)
LOW_M, HIGH_M = POINTS.min(axis=0), POINTS.max(axis=0)
TANGENT = 0.6
VISIBILITY_M = 3.0
# From where a point may just be in view: the bounding box, and what the camera sees beside it.
AROUND_M = 4.0 * TANGENT
places = st.tuples(
    st.floats(LOW_M[0] - AROUND_M, HIGH_M[0] + AROUND_M),
    st.floats(LOW_M[1] - AROUND_M, HIGH_M[1] + AROUND_M),
    st.floats(HIGH_M[2], HIGH_M[2] + 4.0),
)
BESIDE = 2.9 * TANGENT  # seen from 2.95 m above


def looked(track: np.ndarray, last: int) -> tuple[bool, CameraRecord]:
    records = (CameraRecord * 1)(CameraRecord(True, TANGENT, *LOW_M, *HIGH_M))
    visibility = np.array([[0.0], [VISIBILITY_M]])
    is_seen = first_detection(shared(records)[0], track, last, 0.05, visibility, POINTS)
    return is_seen, records[0]


@given(st.lists(places, min_size=1, max_size=30))
@example([(LOW_M[0] - BESIDE, POINTS[POINTS[:, 0].argmin(), 1], LOW_M[2] + 2.95)])
@example([(HIGH_M[0] + BESIDE, POINTS[POINTS[:, 0].argmax(), 1], LOW_M[2] + 2.95)])
@example([(POINTS[POINTS[:, 1].argmin(), 0], LOW_M[1] - BESIDE, LOW_M[2] + 2.95)])
@example([(POINTS[POINTS[:, 1].argmax(), 0], HIGH_M[1] + BESIDE, LOW_M[2] + 2.95)])
def test_first_row_from_which_a_point_is_seen(positions):
    track = np.array(positions)
    seen = [first_point_in_view(*row, VISIBILITY_M, POINTS, TANGENT) for row in track]
    rows = [row for row, point in enumerate(seen) if point >= 0]
    is_seen, camera = looked(track, len(track) - 1)
    assert is_seen == bool(rows)
    if rows:
        assert (camera.next_row, camera.point) == (rows[0], seen[rows[0]])


def test_rows_that_were_looked_at_are_not_looked_at_again():
    far_away = np.full((5, 3), 1000.0)
    is_seen, camera = looked(far_away, 3)
    assert not is_seen
    assert camera.next_row == 4
