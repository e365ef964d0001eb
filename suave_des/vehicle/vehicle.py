"""A vehicle in mission time: events command and disturb it, it can be read at any time, and is
integrated lazily.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from suave_des.compiling import Array
from suave_des.vehicle import kernel
from suave_des.vehicle.model import (
    Autopilot,
    Pose,
    VehicleModel,
    euler_angles,
    kernel_parameters,
    quaternion,
)

STEP_S = 0.05
Point = tuple[float, float, float]
ThrusterState = Literal["works", "frozen", "dead"]
"""A frozen thruster keeps the thrust that it had when it failed; a dead one gives none."""


class ArrivalCheck(NamedTuple):
    """The times at which arrival at a way-point is checked, and the box in which a way-point counts
    as reached.

    Attributes:
        start_s: time of tick 0.
        period_s: time between ticks.
        half_width_m: greatest difference in x and in y.
        half_height_m: greatest difference in z.
        first_check_ticks: from the tick that finds a way-point reached to the first check of the
            next one.
        resend_ticks: from the tick that sends a way-point's set-point to the one that sends it
            again.
        resend_again_ticks: the same, once it has been sent again.
    """

    start_s: float
    period_s: float
    half_width_m: float
    half_height_m: float
    first_check_ticks: int
    resend_ticks: int
    resend_again_ticks: int

    def time_s(self, tick: int) -> float:
        """Return the time of a tick."""
        return self.start_s + tick * self.period_s

    def last_tick_until(self, t_s: float) -> int:
        """Find the last tick up to time t, inclusive: a tick at t comes before anything else that
        happens then.
        """
        tick = math.floor((t_s - self.start_s) / self.period_s + 1e-9)
        return tick if self.time_s(tick) <= t_s else tick - 1


Ticks = tuple[int, int, int]
"""The first tick that checks a way-point, the one that sends it again if it is not reached, and the
last to look at.
"""


class Course(NamedTuple):
    """The way-points that a function flies through.

    Attributes:
        check: the ticks, and the box in which a way-point counts as reached.
        waypoints: positions to reach: x, y, z in the first three columns, m, shape (n, at least 3).
        sent_as_m: offset added to a way-point's x and y in its set-point, and the set-points' z.
        ticks: of the first way-point.
        most: how many set-points are queued at most.
    """

    check: ArrivalCheck
    waypoints: Array
    sent_as_m: Point
    ticks: Ticks
    most: int


Sends = list[list[int]]
"""Set-points to be sent: tick, course, how many of its way-points are reached by then, tick that
sends it again.
"""


class _Queue(NamedTuple):
    """Queued set-points: `before` is in force until the first of them is sent; `last_s` is the time
    of the last one.
    """

    courses: Sequence[Course]
    sends: Sends
    before: Array
    last_s: float

    def sent_until(self, t_s: float) -> int:
        """Count the set-points that have been sent by time t."""
        last = [course.check.last_tick_until(t_s) for course in self.courses]
        return bisect_left(self.sends, True, key=lambda send: send[0] > last[send[1]])


@dataclass(eq=False)
class Vehicle:
    """The vehicle of one mission.

    The track is a table of states on a grid of `STEP_S` seconds of mission time. A reading at time
    t is the state at the grid point nearest to t; a change of control at time t acts from that grid
    point on. Rows are filled when they are first needed; a change of control drops the rows after
    it. So reading, however often, never changes the trajectory, and looking ahead under the present
    control costs nothing but the integration.

    Attributes:
        model: constants of body and thrusters.
        autopilot: the guided controller.
        start: pose at t = 0, at rest; the autopilot's first set-point is this place with heading 0.
        duration_s: length of the mission; nothing can be read beyond it.
        altitude_error_m: how far above its set-point the autopilot holds the vehicle (seen in the
            real runs).
        current_m_per_s: velocity of the water, world frame.
        current_wave: amplitude of a part that varies as a sine, east and north, m/s; and the sine's
            angle per row of the track and at row 0, rad.
        time_scale: simulated seconds that pass in a second of mission time (the simulator's
            real-time factor).
        z_limits_m: sea bed and surface, which stop the vehicle.
        memory: where to keep the track, instead of memory of its own; see `track_rows`.
        track_listeners: each is called after a change of control with the first row that it
            affects.
        control_listeners: called after a change of control by others, one after the other until one
            queues way-points.
        computed_row: last row of the track that is filled.
        thrusters: the state of each.
        expected_changes_s: the next time at which control may be changed, by what may change it.
    """

    model: VehicleModel
    autopilot: Autopilot
    start: Pose
    duration_s: float
    _: KW_ONLY
    altitude_error_m: float = 0.0
    current_m_per_s: Point = (0.0, 0.0, 0.0)
    current_wave: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    time_scale: float = 1.0
    z_limits_m: tuple[float, float] = (-math.inf, math.inf)
    memory: InitVar[Array | None] = None
    track_listeners: list[Callable[[int], None]] = field(default_factory=list, init=False)
    control_listeners: list[Callable[[], None]] = field(default_factory=list, init=False)
    computed_row: int = field(default=0, init=False)
    expected_changes_s: dict[str, float] = field(default_factory=dict, init=False)
    _queue: _Queue | None = field(default=None, init=False)

    def __post_init__(self, memory: Array | None) -> None:
        model, start, rows = self.model, self.start, track_rows(self.duration_s)
        self.last_row = rows - 1
        self.track: Array = np.empty((rows, kernel.COLUMNS)) if memory is None else memory
        self.track[0] = 0.0
        self.track[0, kernel.POSITION] = self.track[0, kernel.LEG_START] = self.track[
            0, kernel.LEG_END
        ] = start[:3]
        self.track[0, kernel.ATTITUDE] = quaternion(*start[3:])
        self.thrusters: list[ThrusterState] = ["works"] * len(model.thrusters)
        least_n, greatest_n = -model.thrust_limit_n, model.thrust_limit_n
        self._thrust_n = np.array([[least_n, greatest_n, 0.0]] * len(model.thrusters), order="F")
        self._set_point = np.array([*start[:3], 1.0, 0.0, 0.0])  # heading 0, number 0
        parameters = kernel_parameters(model, self.autopilot, self.z_limits_m).copy()
        parameters[kernel.CURRENT : kernel.FLOOR] = self.current_m_per_s
        parameters[kernel.WAVE_X :] = self.current_wave
        step_s = STEP_S * self.time_scale
        self._dynamics = (
            step_s,
            self._set_point,
            parameters,
            model.allocation,
            model.wrenches,
            self._thrust_n,
        )

    def command(self, t_s: float, x_m: float, y_m: float, z_m: float) -> None:
        """Give the autopilot a new position set-point, which replaces the previous one."""
        self._cancel_after(t_s)
        self._set_point[:3] = x_m, y_m, z_m + self.altitude_error_m
        self._set_point[kernel.NUMBER] += 1.0
        self._control_changed(t_s)

    def set_thruster(self, t_s: float, thruster: int, state: ThrusterState) -> None:
        """Let one of thrusters 1 .. n fail, or work again. The autopilot is not informed."""
        if self.thrusters[thruster - 1] == state:
            return
        self._cancel_after(t_s)
        limit_n = self.model.thrust_limit_n if state == "works" else 0.0
        thrust_n = 0.0
        if state == "frozen":  # the next step tells what it gives
            row = self.computed_row
            kernel.advance(
                self.track, row, min(row + 1, self.last_row), self._dynamics, *kernel.UNCHECKED
            )
            thrust_n = float(self._thrust_n[thruster - 1, kernel.LAST])
        self.thrusters[thruster - 1] = state
        self._thrust_n[thruster - 1, : kernel.LAST] = thrust_n - limit_n, thrust_n + limit_n
        self._control_changed(t_s)

    def queue_waypoints(
        self, t_s: float, courses: list[Course], until_s: float, *, send: bool
    ) -> tuple[Sends, bool]:
        """Look ahead, and queue set-points: the tick that finds a way-point reached commands the
        next one.

        One that is not reached in time is commanded again, unless it is reached but for its height.
        A change of control cancels the set-points that are still queued then. Ticks after the
        mission's end do not count.

        Args:
            courses: one, or two that are flown at the same time.
            until_s: up to where the track is filled if no set-point is left to the caller; not
                after the mission's end.
            send: whether to command the first way-point of the first course now; the others are
                already commanded.

        Returns:
            The set-points as they will be sent if control does not change; and whether the last of
            them is left to the
            caller: it is one too many, leads to none of the way-points, or might not be the same as
                before.
        """
        is_new = send or (self._queue is not None and t_s < self._queue.last_s)
        if is_new:
            self._cancel_after(t_s)
        if send:
            self._replace_set_point(courses[0], 0, new=1)
        waypoints, first = courses[0].waypoints, 0
        if len(courses) > 1:
            waypoints = np.concatenate([each.waypoints[:, :3] for each in courses])
        numbers = np.empty((len(courses), kernel.GRID + 1))
        for n, each in enumerate(courses):
            end = first + len(each.waypoints)
            numbers[n] = (
                *each.check,
                *each.sent_as_m,
                *each.ticks,
                first,
                first,
                end,
                each.most,
                STEP_S,
            )
            first = end
        before, sends = (
            self._set_point.copy(),
            np.empty((sum([each.most + 1 for each in courses]), 4), np.int64),
        )
        count, is_due, self.computed_row = kernel.fly_waypoints(
            self.track,
            self.computed_row,
            row_at(until_s),
            self._dynamics,
            waypoints,
            numbers,
            sends,
        )
        found: Sends = sends[:count].tolist()
        queued = found[: count - is_due]
        if queued:
            last_s = courses[queued[-1][1]].check.time_s(queued[-1][0])
            self._queue = _Queue(courses, queued, before, last_s)
        if queued or is_new:
            self._track_changed(t_s)
        return found, is_due

    def cancel_waypoints(self, t_s: float) -> None:
        """Cancel the set-points that are queued after time t; whoever looks ahead does so again."""
        self._cancel_after(t_s)
        self._control_changed(t_s)

    def position(self, t_s: float) -> Point:
        """Read the position at time t: x, y, z in m."""
        row = self._row(t_s)
        return self.track.item(row, 0), self.track.item(row, 1), self.track.item(row, 2)

    def pose(self, t_s: float) -> Pose:
        """Read the pose eta at time t."""
        return Pose(*self.position(t_s), *euler_angles(self.track[self._row(t_s), kernel.ATTITUDE]))

    def look_ahead(self, row: int) -> None:
        """Fill the track up to a row as it will be if control does not change.

        Raises:
            ValueError: the row lies beyond the mission's end.
        """
        if row <= self.computed_row:
            return
        if row > self.last_row:  # compiled code would write past the track
            raise ValueError(
                f"the vehicle's track ends at {self.last_row * STEP_S:g} s, before {row * STEP_S:g} s"
            )
        kernel.advance(self.track, self.computed_row, row, self._dynamics, *kernel.UNCHECKED)
        self.computed_row = row

    def _row(self, t_s: float) -> int:
        row = row_at(t_s)
        self.look_ahead(row)
        return row

    def _replace_set_point(self, course: Course, place: int, *, new: int) -> None:
        set_point, (x_m, y_m, z_m) = self._set_point, course.sent_as_m
        set_point[0], set_point[1] = (
            course.waypoints.item(place, 0) + x_m,
            course.waypoints.item(place, 1) + y_m,
        )
        set_point[2] = z_m
        set_point[kernel.NUMBER] += new

    def _cancel_after(self, t_s: float) -> None:
        """Fill the track up to time t, and no further; from there on only the current set-point
        remains.
        """
        self.computed_row = self._row(t_s)
        queue, self._queue = self._queue, None
        if queue is not None and t_s < queue.last_s:
            self._set_point[:] = queue.before
            if sent := queue.sent_until(t_s):
                _, course, place, _ = queue.sends[sent - 1]
                self._replace_set_point(queue.courses[course], place, new=sent)

    def _track_changed(self, t_s: float) -> None:
        row = row_at(t_s)
        for listener in self.track_listeners:
            listener(row)

    def _control_changed(self, t_s: float) -> None:
        for listener in self.control_listeners:
            if self._queue is None:
                listener()
        if self._queue is None:
            self._track_changed(t_s)


def track_rows(duration_s: float) -> int:
    """Count the rows of a mission's track; each has `kernel.COLUMNS` columns."""
    return row_at(duration_s) + 2


def row_at(t_s: float) -> int:
    """Find the row of the track nearest to a mission time; ties go to the even row, as in every
    such conversion.
    """
    return round(t_s / STEP_S)
