"""Pipeline detection: the first sight on the vehicle's way, whoever looks at the vehicle
meanwhile.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.clock import MissionEnvironment
from suave_des.events import texts_of
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.flight import Flight
from suave_des.scenario.models import Pipeline
from suave_des.vehicle.model import Autopilot, Pose
from suave_des.vehicle.vehicle import STEP_S, Vehicle
from suave_des.world.pipeline import CameraRecord, first_point_in_view, sample_points
from tests.helpers.stand_ins import BLUEROV2, VIEW_TANGENT

POINTS = sample_points(Pipeline().vertices_m)
DURATION_S = 120.0
BESIDE = Pose(-17.0, 4.0, -18.0, 0.0, 0.0, 0.0)


class Sight:
    """A vehicle that is sent to places at given times, and a detector."""

    def __init__(
        self,
        commands: list,
        visibility_m: float = 3.0,
        readings: tuple[float, ...] = (),
        start: Pose = BESIDE,
    ) -> None:
        self.env = MissionEnvironment()
        self.vehicle = Vehicle(BLUEROV2, Autopilot(), start, DURATION_S)
        self.visibility_m = visibility_m
        self.logged: list[tuple[float, str]] = []
        self.detector = PipelineDetector(
            self.env,
            lambda source, happening: self.logged.append((self.env.now, texts_of(happening)[0])),
        )
        camera = CameraRecord(True, VIEW_TANGENT, *POINTS.min(axis=0), *POINTS.max(axis=0))
        always = np.array([[0.0], [visibility_m]])
        flight = Flight(self.vehicle, camera, POINTS, always, np.empty((0, 3)))
        self.env.fly_to = flight.fly_to
        flight.begin(self.detector, None, None)
        for t_s, place in commands:
            self.env.process(
                self._at(t_s, lambda place=place: self.vehicle.command(self.env.now, *place))
            )
        for t_s in readings:
            self.env.process(self._at(t_s, lambda: self.vehicle.pose(self.env.now)))

    def _at(self, t_s: float, action):
        yield self.env.timeout(t_s)
        action()

    def run(self) -> tuple[float, int | None]:
        self.env.run(until=DURATION_S)
        return self.detector.detected_s, self.detector.first_point


TO_THE_PIPELINE = [(5.0, (-17.0, -4.0, -18.0))]


def first_sight(sight: Sight) -> tuple[float, int]:
    """The same found by looking at every row of the finished track."""
    track = sight.vehicle.track
    for row in range(sight.vehicle.state.row + 1):
        point = first_point_in_view(*track[row, :3], sight.visibility_m, POINTS, VIEW_TANGENT)
        if point >= 0:
            return row * STEP_S, point
    raise AssertionError("never in view")


def test_detection_is_the_first_row_of_the_way_with_a_point_in_view():
    sight = Sight(TO_THE_PIPELINE)
    detected_s, point = sight.run()
    assert (detected_s, point) == first_sight(sight)
    assert sight.logged == [(detected_s, "pipeline_detected")]


def test_vehicle_that_starts_over_the_pipeline_sees_it_at_once():
    assert Sight([], start=Pose(-17.0, 0.0, -18.0, 0, 0, 0)).run()[0] == 0.0


def test_a_command_in_time_turns_the_vehicle_away_before_it_sees_anything():
    sight = Sight([*TO_THE_PIPELINE, (5.0, (-17.0, 4.0, -18.0))])
    assert sight.run() == (math.inf, None)


def test_without_sight_until_the_end_there_is_no_detection():
    assert Sight(TO_THE_PIPELINE, visibility_m=1.0).run() == (math.inf, None)


commands = st.lists(
    st.tuples(
        st.floats(0.0, 60.0),
        st.tuples(st.floats(-20, -14), st.floats(-3, 4), st.floats(-19.5, -17)),
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=60)
@given(commands, st.lists(st.floats(0.0, 100.0), max_size=20))
def test_detection_does_not_depend_on_who_reads_the_vehicle(commands, readings):
    assert Sight(commands).run() == Sight(commands, readings=tuple(readings)).run()


@settings(max_examples=60)
@given(commands)
def test_detection_under_many_commands_is_still_the_first_sight(commands):
    sight = Sight(commands)
    found = sight.run()
    if found[1] is not None:
        assert found == first_sight(sight)
    else:
        with pytest.raises(AssertionError, match="never in view"):
            first_sight(sight)
