"""The pipeline's points, which of them a camera sees, and signals over mission time."""

import math

import numpy as np
import pytest

from suave_des.compiling import shared
from suave_des.scenario.models import Pipeline
from suave_des.world.pipeline import (
    CameraRecord,
    first_detection,
    first_point_in_view,
    sample_points,
)
from suave_des.world.signals import sinusoid, step, table

POINTS = sample_points(Pipeline().vertices_m)
HALF_WIDTH_AT_1_M = math.tan(math.radians(30.0))


def above(
    index: int, height_m: float, dx_m: float = 0.0, dy_m: float = 0.0
) -> tuple[float, float, float]:
    x, y, z = POINTS[index]
    return float(x) + dx_m, float(y) + dy_m, float(z) + height_m


def test_pipeline_has_100_points():
    assert POINTS.shape == (100, 3)


@pytest.mark.parametrize(
    ("index", "vertex"), [(19, (-25.0, 0.0)), (59, (-37.41, -1.0)), (99, (-51.56, -15.14))]
)
def test_each_piece_ends_with_its_last_vertex(index, vertex):
    assert POINTS[index, :2] == pytest.approx(vertex)


@pytest.mark.parametrize(
    ("dx_m", "dy_m", "seen"),
    [(0.999, 0.999, True), (1.001, 0.0, False), (0.0, 1.001, False), (0.0, -0.999, True)],
    ids=["corner of the view", "outside in x", "outside in y", "other side"],
)
def test_view_is_a_square_of_half_width_h_tan_30(dx_m, dy_m, seen):
    end = POINTS[:1]
    x, y, z = above(0, 2.0, 2.0 * HALF_WIDTH_AT_1_M * dx_m, 2.0 * HALF_WIDTH_AT_1_M * dy_m)
    assert (first_point_in_view(x, y, z, 3.0, end, HALF_WIDTH_AT_1_M) == 0) is seen


@pytest.mark.parametrize(("visibility_m", "seen"), [(1.999, False), (2.0, True), (2.001, True)])
def test_point_is_visible_up_to_the_water_visibility(visibility_m, seen):
    assert (
        first_point_in_view(*above(30, 2.0), visibility_m, POINTS, HALF_WIDTH_AT_1_M) >= 0
    ) is seen


def test_lowest_index_of_the_points_in_view_counts():
    # 2 m up the view reaches 1.15 m to each side: two points of the 0.5 m grid.
    assert first_point_in_view(*above(10, 2.0), 3.0, POINTS, HALF_WIDTH_AT_1_M) == 8


def test_without_a_measurement_nothing_is_seen():
    assert first_point_in_view(*above(30, 1.0), math.nan, POINTS, HALF_WIDTH_AT_1_M) == -1


def test_height_of_the_detected_points_narrows_the_view():
    # revision 2023: 0.25 m below a vehicle at 1 m altitude
    raised = POINTS + np.array([0.0, 0.0, 0.75])
    camera = above(30, 1.0, dy_m=0.2)
    assert first_point_in_view(*camera, 3.0, POINTS, HALF_WIDTH_AT_1_M) >= 0
    assert first_point_in_view(*camera, 3.0, raised, HALF_WIDTH_AT_1_M) == -1


def line_of_positions(y_m: float) -> np.ndarray:
    """From far east of the pipeline to over its second piece, at 2 m altitude."""
    x = np.linspace(0.0, -30.0, 301)
    return np.column_stack([x, np.full_like(x, y_m), np.full_like(x, -18.0)])


def detected(track: np.ndarray, times_s: list[float], visibility_m: list[float]) -> tuple[int, int]:
    """The first row with a point in view, and the point."""
    camera = CameraRecord(True, HALF_WIDTH_AT_1_M, *POINTS.min(axis=0), *POINTS.max(axis=0))
    cameras = shared((CameraRecord * 1)(camera))
    visibility = np.array([times_s, visibility_m])
    last = len(track) - 1
    assert first_detection(cameras[0], track, last, 1.0, visibility, POINTS)
    return int(cameras["next_row"][0]), int(cameras["point"][0])


def test_first_detection_is_the_first_row_with_a_point_in_view():
    track = line_of_positions(0.5)
    expected = next(
        (row, point)
        for row, position in enumerate(track)
        if (point := first_point_in_view(*position, 3.0, POINTS, HALF_WIDTH_AT_1_M)) >= 0
    )
    assert detected(track, [0.0], [3.0]) == expected


def test_first_detection_waits_for_the_visibility():
    assert detected(line_of_positions(0.0), [3.0, 250.0], [1.0, 2.5])[0] == 250


PAPER = sinusoid(80.0, 1.25, 3.75)


@pytest.mark.parametrize(
    ("t_s", "value"),
    [(0.0, 3.75), (20.0, 2.5), (40.0, 1.25), (60.0, 2.5), (80.0, 3.75), (240.0, 3.75)],
)
def test_sinusoid_starts_at_its_maximum(t_s, value):
    assert PAPER(t_s) == pytest.approx(value)


def test_shift_moves_the_sinusoid_to_earlier_times():
    assert sinusoid(80.0, 1.25, 3.75, shift_s=30.0)(10.0) == pytest.approx(1.25)


def test_step_has_its_new_value_from_its_time_on():
    signal = step(10.0, 3.0, 1.0)
    assert [signal(9.999), signal(10.0), signal(11.0)] == [3.0, 1.0, 1.0]


TIMES, VALUES = (0.0, 10.0, 20.0), (1.0, 3.0, 2.0)


@pytest.mark.parametrize(
    ("t_s", "value"), [(-5.0, 1.0), (0.0, 1.0), (9.9, 1.0), (10.0, 3.0), (19.0, 3.0), (99.0, 2.0)]
)
def test_table_keeps_the_value_before(t_s, value):
    assert table(TIMES, VALUES)(t_s) == value


@pytest.mark.parametrize(
    ("t_s", "value"), [(-5.0, 1.0), (5.0, 2.0), (10.0, 3.0), (15.0, 2.5), (20.0, 2.0), (99.0, 2.0)]
)
def test_linear_table_draws_straight_lines(t_s, value):
    assert table(TIMES, VALUES, linear=True)(t_s) == pytest.approx(value)
