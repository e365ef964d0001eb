"""The flight: between two events nothing changes but the vehicle's pose, so that one compiled call
flies to the next event.

On the way the functions tick: each looks whether its way-point is reached, and sends the next one,
or the same again. None of that needs an event. Three things end a flight early: the pipeline is
seen, and the end of the path is reached, which become events at their times; and the message of a
set-point is lost, for then the next loss has to be drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import partial

import numpy as np

from suave_des.compiling import Array, Record, Records, compiled, for_types_of, record, shared
from suave_des.managed import follow, search
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.follow import Follow, FollowPipeline
from suave_des.managed.search import GenerateSearchPath, Search
from suave_des.managed.waypoints import Does, next_tick_s
from suave_des.vehicle.kernel import VehicleRecord, advance
from suave_des.vehicle.vehicle import STEP_S, Vehicle
from suave_des.world.pipeline import CameraRecord, first_detection


class Ends(IntEnum):
    """Why a flight ends."""

    THERE = 0
    SIGHT = 1  # a point of the pipeline is seen
    FINISH = 2  # the end of the path is reached
    LOSS = 3  # the message of a set-point is lost


_THERE = Ends.THERE.value


@record
class FlightRecord(Record):
    """What is flown, besides the vehicle."""

    search: Search
    follow: Follow
    camera: CameraRecord
    next_tick_s: float  # mission time of the next tick of a function; inf: none ticks
    loses_search: bool  # whether the message that was lost is the search's


_OneRecord = FlightRecord * 1
_BEFORE = 1
"""Place of the vehicle's copy among the records: as it was before the last rows."""


@compiled
def fly(
    flights: Records,
    vehicles: Records,
    track: Array,
    path: Array,
    points: Array,
    visibility: Array,
    until_s: float,
) -> int:
    """Fly to a mission time, with all ticks of the functions up to then, and at that very time.

    Args:
        flights: the flight's record.
        vehicles: the vehicle's record, and room for a copy.
        track: see `advance`.
        path: see `there_and_back`.
        points, visibility: see `first_detection`.

    Returns:
        Why the flight ends, one of `Ends`.
    """
    flight: FlightRecord = flights[0]
    vehicle: VehicleRecord = vehicles[0]
    camera, last_row = flight.camera, track.shape[0] - 1
    while True:
        search_s, follow_s = next_tick_s(flight.search.timer), next_tick_s(flight.follow.timer)
        flight.next_tick_s = min(search_s, follow_s)
        row = min(int(np.rint(min(flight.next_tick_s, until_s) / STEP_S)), last_row)
        if row > vehicle.row:
            if camera.is_open:
                vehicles[_BEFORE] = vehicle
            advance(vehicles, track, row)
        if first_detection(camera, track, vehicle.row, STEP_S, visibility, points):
            if camera.next_row < vehicle.row:
                # Control may change at the first sight, so the vehicle is flown again, up to that.
                vehicles[0] = vehicles[_BEFORE]
            return Ends.SIGHT.value
        if flight.next_tick_s > until_s:
            return Ends.THERE.value
        is_search, arrives = search_s <= follow_s, True
        if is_search:
            does = search.tick(flight.search, track, row)
            if does == Does.SENDS.value:
                arrives = search.send_waypoint(flight.search, vehicle)
        else:
            does = follow.tick(flight.follow, track, row, path)
            if does == Does.SENDS.value:
                arrives = follow.send_point(flight.follow, vehicle, path)
        if does == Does.FINISHES.value:
            return Ends.FINISH.value
        if not arrives:
            flight.loses_search = is_search
            return Ends.LOSS.value


_compiled: list[Callable[..., int]] = []


def compiled_flight(*arrays: Array) -> Callable[..., int]:
    """Return `fly` for arrays such as those of every flight."""
    if not _compiled:
        _compiled.append(for_types_of(fly, *arrays, 0.0))
    return _compiled[0]


class Flight:
    """Flies the vehicle of one mission, as its functions guide it.

    Attributes:
        vehicle: the vehicle that is flown.
        detector: is told of the first sight.
        state: the functions' numbers, and those of the camera.
    """

    def __init__(
        self, vehicle: Vehicle, camera: CameraRecord, points: Array, visibility: Array, path: Array
    ) -> None:
        self.vehicle = vehicle
        records = _OneRecord()
        self.state: FlightRecord = records[0]
        self.state.camera = camera
        arrays = shared(records), vehicle.records, vehicle.track, path, points, visibility
        self._fly = partial(compiled_flight(*arrays), *arrays)

    def begin(
        self, detector: PipelineDetector, search: GenerateSearchPath, follow: FollowPipeline
    ) -> None:
        """Begin at t = 0: look for the pipeline from there."""
        self._detector, self._search, self._follow = detector, search, follow
        self.fly_to(0.0)

    def fly_to(self, t_s: float) -> None:
        """Fly to mission time t; what ends the flight earlier becomes an event."""
        while (ends := self._fly(t_s)) != _THERE:
            if ends == Ends.SIGHT:
                camera = self.state.camera
                seen_s = camera.next_row * STEP_S
                self._detector.detect_at(seen_s, camera.point)
                t_s = min(t_s, seen_s)
            elif ends == Ends.LOSS:
                lost = self._search if self.state.loses_search else self._follow
                lost.message_lost()
            else:
                self._follow.reaches_end(self.state.next_tick_s)
                return

    def close(self) -> None:
        """Let go of the functions: there is no further flight."""
        del self._detector, self._search, self._follow
