"""The vehicle that a scenario describes, its position at the start, and the current."""

from math import cos, sin
from typing import NamedTuple

from suave_des import domain
from suave_des.chance import Chance
from suave_des.compiling import Array
from suave_des.scenario.models import Scenario
from suave_des.simulation.prepared import PreparedScenario
from suave_des.vehicle.autopilot import Autopilot
from suave_des.vehicle.frames import Pose
from suave_des.vehicle.vehicle import CurrentWave, Point, Vehicle


class StartPlace(NamedTuple):
    """The place where a mission begins.

    Attributes:
        position_m: x and y of the vehicle, world frame.
        origin_m: x and y of the origin of the search, world frame.
    """

    position_m: tuple[float, float]
    origin_m: tuple[float, float]


def draw_start(chance: Chance) -> StartPlace:
    """Draw the start position, including the drift before the mission."""
    value = chance.value
    x_m, y_m = (value(f"start.{axis}_m") + value(f"calibration.drift_{axis}_m") for axis in "xy")
    return StartPlace((x_m, y_m), (x_m + value("calibration.origin_x_m"), y_m + value("calibration.origin_y_m")))


def make_vehicle(
    prepared: PreparedScenario, chance: Chance, start: StartPlace, track: Array, *, reasons: bool
) -> Vehicle:
    """Make the vehicle of one mission.

    Args:
        prepared: the scenario.
        chance: of the run.
        start: the start position.
        track: to be filled with the vehicle's states, a row for each time step.
        reasons: whether a reasoner runs on the simulator's computer, and slows it down.
    """
    scenario, value = prepared.loaded.scenario, chance.value
    calibration = scenario.calibration
    z_m, heading_rad = value("start.z_m"), value("start.heading_rad")
    altitude_error_m = value("calibration.altitude_error_m")
    autopilot = Autopilot(
        calibration.position_gain_per_s,
        calibration.jerk_m_per_s3,
        calibration.velocity_gain_per_s,
        calibration.velocity_integral_gain_per_s2,
        calibration.heading_frequency_rad_per_s,
        calibration.heading_integral_gain_per_s3,
    )
    loss = value("calibration.real_time_factor_loss")
    if reasons:
        loss += scenario.reasoning_share() * value("calibration.reasoning_slowdown")
    current_m_per_s, wave = _current(scenario, chance)
    return Vehicle(
        prepared.vehicle_model,
        autopilot,
        Pose(*start.position_m, z_m, 0.0, 0.0, heading_rad),
        prepared.duration_s,
        altitude_error_m=altitude_error_m,
        current_m_per_s=current_m_per_s,
        current_wave=wave,
        time_scale=1.0 / (1.0 + loss),
        z_limits_m=(domain.SEA_BED_Z_M, domain.SURFACE_Z_M),
        memory=track,
    )


def _current(scenario: Scenario, chance: Chance) -> tuple[Point, CurrentWave]:
    """Draw the current: its constant part, and the one that varies over time."""
    value, wave = chance.value, scenario.current.wave
    x, y, z = (value(f"current.{axis}_m_per_s") for axis in "xyz")
    if wave is None:
        return (x, y, z), CurrentWave()
    east, north = cos(direction_rad := value("current.wave.direction_rad")), sin(direction_rad)
    mean, amplitude = value("current.wave.mean_m_per_s"), value("current.wave.amplitude_m_per_s")
    varying = CurrentWave((amplitude * east, amplitude * north), wave.period_s, value("current.wave.shift_s"))
    return (x + mean * east, y + mean * north, z), varying
