"""Stand-ins for what a function of the managed subsystem needs around it, and the shipped
vehicle.
"""

import random
from collections.abc import Callable
from functools import cache

import simpy

from suave_des.managed.node import SetPointSender
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Revision
from suave_des.scenario.modes import Mode
from suave_des.simulation.prepared import vehicle_model
from suave_des.vehicle import kernel
from suave_des.vehicle.model import GRAVITY_M_PER_S2
from suave_des.vehicle.vehicle import Vehicle, row_at

Place = tuple[float, float, float]
START = (-17.0, 2.0, -18.5)


class PlacedVehicle:
    """A vehicle that is where the test puts it, and keeps its commands.

    With `obeys` it is at each set-point at once, `rise_m` above it.
    """

    def __init__(self, place: Place = START, *, obeys: bool = False, rise_m: float = 0.0) -> None:
        self.control_listeners: list[Callable[[], None]] = []
        self.duration_s, self.expected_changes_s, self.thrusters = (
            1000.0,
            dict[str, float](),
            list[str](),
        )
        self._place, self.obeys = place, obeys
        self.sends = False  # whether a way-point is being sent
        self.rise_m, self.altitude_error_m = rise_m, 0.0
        self.commands: list[tuple[float, Place]] = []

    @property
    def place(self) -> Place:
        return self._place

    @place.setter
    def place(self, place: Place) -> None:
        """Put it elsewhere: like a change of control, this invalidates what was looked ahead."""
        self._place = place
        if not self.sends:
            self.cancel_waypoints(0.0)

    def position(self, t_s: float) -> Place:
        return self.place

    def queue_waypoints(self, t_s, courses, until_s, *, send):
        """Look at the first way-point only: where a later set-point takes the vehicle cannot be
        known beforehand.
        """
        ((check, waypoints, sent_as_m, (first, again, _), _),) = courses
        if send:
            self.sends = True
            self.command(t_s, *(waypoints[0, :2] + sent_as_m[:2]).tolist(), sent_as_m[2])
            self.sends = False
        halves_m = check.half_width_m, check.half_width_m, check.half_height_m
        for tick in range(first, again + 1):
            errors_m = [
                abs(a - b)
                for a, b in zip(self.position(check.time_s(tick)), waypoints[0, :3], strict=True)
            ]
            if all(error_m <= half_m for error_m, half_m in zip(errors_m, halves_m, strict=True)):
                return [[tick, 0, 1, tick + check.resend_ticks]], True
        return [[again, 0, 0, again]], True

    def cancel_waypoints(self, t_s: float) -> None:
        """Tell the listeners, although no set-point is ever queued."""
        for listener in self.control_listeners:
            listener()

    def command(self, t_s: float, x_m: float, y_m: float, z_m: float) -> None:
        self.commands.append((t_s, (x_m, y_m, z_m)))
        if self.obeys:
            self.place = (x_m, y_m, z_m + self.rise_m)

    @property
    def commanded(self) -> list[Place]:
        return [place for _, place in self.commands]

    @property
    def times_s(self) -> list[float]:
        return [round(t_s, 6) for t_s, _ in self.commands]


class MovingVehicle(PlacedVehicle):
    """A vehicle that goes its way over time whatever it is commanded."""

    def __init__(self, way: Callable[[float], Place]) -> None:
        super().__init__()
        self._way = way

    def position(self, t_s: float) -> Place:
        return self._way(t_s)


@cache
def revision(name: str) -> Revision:
    """The shipped revision "2023", "2025" or "1.5"."""
    return load_scenario(
        {"2023": "seams2023", "2025": "planta_exp1", "1.5": "release15"}[name]
    ).scenario.revision


def sender(env: simpy.Environment, vehicle: PlacedVehicle) -> SetPointSender:
    """A connection to the autopilot without losses and frame errors."""
    return SetPointSender(vehicle, env, stream=random.Random(0))


def spiral_at(altitude_m: float) -> Mode:
    """An active search mode."""
    return Mode(f"at_{altitude_m:g}", True, {"spiral_altitude": altitude_m})


ACTIVE = Mode("active", True, {})
INACTIVE = Mode("fd_unground", False, {})


def silent(source: str, event: str, detail: str) -> None:
    """A log that keeps nothing."""


VEHICLE = load_scenario("seams2023").scenario.vehicle
BLUEROV2 = vehicle_model(VEHICLE)
DISPLACED_KG = BLUEROV2.water_density_kg_per_m3 * BLUEROV2.displaced_volume_m3
NET_BUOYANCY_N = (DISPLACED_KG - BLUEROV2.mass_kg) * GRAVITY_M_PER_S2
VIEW_TANGENT = VEHICLE.camera.tangent


def nu(vehicle: Vehicle, t_s: float) -> tuple[float, ...]:
    """The velocity nu at time t: body frame, six components in m/s and rad/s."""
    vehicle.position(t_s)
    return tuple(vehicle.track[row_at(t_s), kernel.VELOCITY].tolist())
