"""Stand-ins for what a function of the managed subsystem needs around it, and the shipped
vehicle.
"""

import random
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from suave_des.clock import MissionEnvironment
from suave_des.compiling import Array
from suave_des.managed.flight import Flight
from suave_des.managed.node import SetPointSender
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Revision
from suave_des.scenario.modes import Mode
from suave_des.simulation.prepared import vehicle_model
from suave_des.vehicle.model import GRAVITY_M_PER_S2, Autopilot, Pose
from suave_des.vehicle.vehicle import STEP_S, Vehicle, row_at
from suave_des.world.pipeline import CameraRecord

Place = tuple[float, float, float]
START = (-17.0, 2.0, -18.5)
NOTHING_TO_SEE = CameraRecord(), np.empty((0, 3)), np.empty((2, 0))


class PlacedVehicle:
    """A real vehicle in a flight, with a track that the test has written: it is where the test puts
    it, or goes its way over time, whatever it is commanded; and its commands.

    With `obeys` it is at each set-point at once, `rise_m` above it.
    """

    def __init__(
        self,
        place: Place | Callable[[float], Place] = START,
        *,
        path: Array = np.empty((0, 3)),  # noqa: B008 - which nothing changes
        obeys: bool = False,
        rise_m: float = 0.0,
    ) -> None:
        self.env = MissionEnvironment()
        self.vehicle = Vehicle(BLUEROV2, Autopilot(), Pose(*START, 0.0, 0.0, 0.0), 200.0)
        self.vehicle.state.row = self.vehicle.last_row  # all is flown
        self.vehicle._fly_to_control = lambda t_s: None  # and can be commanded all the same
        camera, points, visibility = NOTHING_TO_SEE
        self.flight = Flight(self.vehicle, camera, points, visibility, path)
        self.env.fly_to = self.flight.fly_to
        self.obeys, self.rise_m = obeys, rise_m
        self.commands: list[tuple[float, Place]] = []
        self.put(place)

    def put(self, place: Place | Callable[[float], Place]) -> None:
        """Put it elsewhere, or on another way, from now on."""
        now = row_at(self.env.now)
        for row in range(now, len(self.vehicle.track)):
            self.vehicle.track[row, :3] = place(row * STEP_S) if callable(place) else place

    def run(self, until_s: float) -> None:
        """Let mission time pass, a step of the track at a time, and note each command."""
        self._note()
        for row in range(row_at(self.env.now) + 1, row_at(until_s) + 1):
            self.env.advance(row * STEP_S)
            self._note()

    def _note(self) -> None:
        state = self.vehicle.state
        if state.set_point_number == len(self.commands):
            return
        place = state.set_point_x_m, state.set_point_y_m, state.set_point_z_m
        while len(self.commands) < state.set_point_number:  # in between there were others
            self.commands.append((round(self.env.now, 6), place))
        if self.obeys:
            self.put((*place[:2], place[2] + self.rise_m))

    @property
    def commanded(self) -> list[Place]:
        return [place for _, place in self.commands]

    @property
    def times_s(self) -> list[float]:
        return [t_s for t_s, _ in self.commands]

    @property
    def sender(self) -> SetPointSender:
        """A connection to the autopilot without losses and frame errors."""
        return SetPointSender(self.vehicle, self.env, stream=random.Random(0))


@cache
def revision(name: str) -> Revision:
    """The shipped revision "2023", "2025" or "1.5"."""
    return load_scenario(
        {"2023": "seams2023", "2025": "planta_exp1", "1.5": "release15"}[name]
    ).scenario.revision


def spiral_at(altitude_m: float) -> Mode:
    """An active search mode."""
    return Mode(f"at_{altitude_m:g}", True, {"spiral_altitude": altitude_m})


ACTIVE = Mode("active", True, {})
INACTIVE = Mode("fd_unground", False, {})


def silent(source: str, happening: NamedTuple) -> None:
    """A log that keeps nothing."""


VEHICLE = load_scenario("seams2023").scenario.vehicle
BLUEROV2 = vehicle_model(VEHICLE)
DISPLACED_KG = BLUEROV2.water_density_kg_per_m3 * BLUEROV2.displaced_volume_m3
NET_BUOYANCY_N = (DISPLACED_KG - BLUEROV2.mass_kg) * GRAVITY_M_PER_S2
VIEW_TANGENT = VEHICLE.camera.tangent


def nu(vehicle: Vehicle, t_s: float) -> tuple[float, ...]:
    """The velocity nu at time t, at which the vehicle is then: six components in m/s and rad/s."""
    vehicle.position(t_s)
    state = vehicle.state
    assert state.row == row_at(t_s)
    linear = state.u_m_per_s, state.v_m_per_s, state.w_m_per_s
    return *linear, state.p_rad_per_s, state.q_rad_per_s, state.r_rad_per_s


def set_nu(vehicle: Vehicle, nu: Sequence[float]) -> None:
    """Set the velocity nu."""
    state = vehicle.state
    state.u_m_per_s, state.v_m_per_s, state.w_m_per_s = nu[:3]
    state.p_rad_per_s, state.q_rad_per_s, state.r_rad_per_s = nu[3:]
