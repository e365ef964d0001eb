"""The physical part of a scenario: the vehicle, its start, pipeline, water, battery, and failures.

Values of vehicles with their sources: scenarios/vehicles.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from suave_des.domain import SEA_BED_Z_M, SURFACE_Z_M, THRUSTERS
from suave_des.errors import shown
from suave_des.scenario.quantities import (
    FARTHEST_M,
    LONGEST_S,
    Coordinate,
    CoordinateDistribution,
    CurrentDistribution,
    Distribution,
    Duration,
    HeadingDistribution,
    Length,
    Period,
    Real,
    ShiftDistribution,
    Strict,
    TimeDistribution,
    ValueDistribution,
    Within,
    wrong,
)
from suave_des.scenario.signal_kinds import Monitor

Positive = Annotated[Real, Within(gt=0, le=1e6)]
Offset = Annotated[Real, Within(-FARTHEST_M, FARTHEST_M, unit="m")]
Component = Annotated[Real, Within(-1.0, 1.0)]
_UNIT_TOLERANCE = 1e-3


class Camera(Strict):
    """The camera, which looks straight down."""

    field_of_view_deg: Annotated[Real, Within(gt=0, lt=180, unit="degrees")]
    """Full angle of view, the same in x and y; it also determines the spacing of the search spiral's turns."""

    @property
    def tangent(self) -> float:
        """Half the width of the view at a distance of 1 m."""
        return math.tan(math.radians(self.field_of_view_deg) / 2.0)


class ThrusterDescription(Strict):
    """One thruster, in the body frame (x forward, y left, z up, origin at the centre of mass)."""

    position_m: tuple[Offset, Offset, Offset]
    """Where it is."""
    direction: tuple[Component, Component, Component]
    """Unit vector of its force at positive command."""

    @field_validator("direction", mode="after")
    @classmethod
    def _is_a_unit_vector(cls, value: Any) -> Any:
        length = math.hypot(*value)
        if abs(length - 1.0) > _UNIT_TOLERANCE:
            raise wrong(f"{list(value)} has length {length:.4g}", "give a vector of length 1")
        return value


class VehicleDescription(Strict):
    """The vehicle's body, thrusters and camera."""

    name: str
    """Name, for people."""
    mass_kg: Positive
    """Mass."""
    inertia_kg_m2: tuple[Positive, Positive, Positive]
    """Principal moments of inertia Ixx, Iyy, Izz."""
    displaced_volume_m3: Positive
    """Volume of water that the submerged body displaces."""
    water_density_kg_per_m3: Positive
    """Density of the water."""
    centre_of_buoyancy_m: Offset
    """Height above the centre of mass at which buoyancy acts."""
    quadratic_drag: tuple[Positive, Positive, Positive, Positive, Positive, Positive]
    """Coefficients c of the drag -c |v| v: surge, sway, heave (N s^2/m^2), roll, pitch, yaw (N m s^2)."""
    thrust_limit_n: Positive
    """Greatest thrust of each thruster, in both directions."""
    thrusters: Annotated[tuple[ThrusterDescription, ...], Field(min_length=6, max_length=6)]
    """The six thrusters, in the order of their numbers."""
    camera: Camera
    """The camera."""


class CurrentWaveDescription(Strict):
    """A current whose speed oscillates: mean + amplitude sin(2 pi (t + shift) / period), in one direction."""

    mean_m_per_s: CurrentDistribution = 0.0
    """Mean speed, drawn once per run."""
    amplitude_m_per_s: CurrentDistribution = 0.0
    """Amplitude of the oscillation, drawn once per run."""
    period_s: Annotated[Real, Within(1.0, LONGEST_S, unit="s")] = 120.0
    """Time from one maximum of the speed to the next."""
    shift_s: ShiftDistribution = 0.0
    """Added to mission time, drawn once per run."""
    direction_rad: HeadingDistribution = 0.0
    """Direction in which the water flows, from east towards north, drawn once per run."""


class Current(Strict):
    """Velocity of the water in the world frame: a constant part, drawn once per run, and one that varies over time."""

    x_m_per_s: CurrentDistribution = 0.0
    """Towards east."""
    y_m_per_s: CurrentDistribution = 0.0
    """Towards north."""
    z_m_per_s: CurrentDistribution = 0.0
    """Upwards."""
    wave: CurrentWaveDescription | None = None
    """The part that varies over time, if any."""


class Leak(Strict):
    """A leak: the vehicle abandons its tasks and surfaces."""

    time_s: TimeDistribution
    """Time at which it is detected, drawn once per run."""


class Start(Strict):
    """Where the vehicle is placed, in the world frame (x east, y north, z up; the sea bed is the plane z = -20)."""

    x_m: CoordinateDistribution = -17.0
    """East."""
    y_m: CoordinateDistribution = 2.57
    """North."""
    z_m: Annotated[Distribution, Within(gt=SEA_BED_Z_M, le=SURFACE_Z_M, unit="m, between sea bed and surface")] = -18.5
    """Up; the sea bed is at -20, the surface at 0."""
    heading_rad: HeadingDistribution = 0.0
    """Yaw, from east towards north."""


class Pipeline(Strict):
    """The pipeline on the sea bed."""

    vertices_m: Annotated[
        tuple[tuple[Coordinate, Coordinate, Coordinate], ...], Field(min_length=2, max_length=1000)
    ] = (
        (-15.0, 0.0, -20.0),
        (-25.0, 0.0, -20.0),
        (-35.0, 0.0, -20.0),
        (-37.41, -1.0, -20.0),
        (-44.49, -8.07, -20.0),
        (-51.56, -15.14, -20.0),
    )
    """Vertices [x, y, z] in order. The default is the exemplar's pipeline (kas-lab/suave)."""
    points_per_piece: Annotated[int, Field(strict=True), Within(1, 1000)] = 20
    """Evenly spaced points on each straight piece, its first vertex excluded and its last included."""


_EVENT_TEXT = re.compile(r"^\(\s*(?P<thruster>[^,]*?)\s*,\s*(?P<event>[^,]*?)\s*,\s*(?P<time_s>[^,]*?)\s*\)$")


class ThrusterEvent(Strict):
    """A failure or recovery of one thruster; also given as the exemplar writes it: "(1,failure,35)"."""

    thruster: Annotated[int, Field(strict=True), Within(1, THRUSTERS)]
    """1 to 4 horizontal (front right, front left, rear right, rear left), 5 and 6 vertical (right, left)."""
    event: Literal["failure", "recovery"]
    """What happens to it."""
    recoverable: bool = True
    """Whether f_maintain_motion can recover the thruster after this failure."""
    time_s: TimeDistribution
    """Time, drawn once per run; the revision decides whether it counts from the start or from the previous event.
    A draw below 0 is 0."""

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        match = _EVENT_TEXT.match(value.strip())
        if match is None:
            remedy = "write (THRUSTER,failure or recovery,TIME), as in (1,failure,35)"
            raise wrong(f"{shown(value)} is not a thruster event", remedy)
        parts: dict[str, Any] = match.groupdict()
        for key, convert, expected in (("thruster", int, "a whole number from 1 to 6"), ("time_s", float, "a number")):
            try:
                if not parts[key].isascii() or "_" in parts[key]:  # digits to Python, and to nobody else
                    raise ValueError
                parts[key] = convert(parts[key])
            except ValueError:
                raise wrong(f"expected {expected} as {key}, got {shown(parts[key])}", "as in (1,failure,35)") from None
        return parts


class Battery(Monitor):
    """Battery of revision 1.5: falls linearly from 1.0, recharged at once near the station."""

    discharge_time_s: Duration = 200.0
    """Time from full (1.0) to empty (0.0)."""
    publishing_period_s: Period = 1.0
    """Period at which its level is published."""
    station_x_m: Coordinate = -3.0
    """Recharge station, east."""
    station_y_m: Coordinate = -2.0
    """Recharge station, north."""
    station_radius_m: Length = 0.5
    """Half-width of the box in x and y within which the vehicle counts as docked."""
    noise: ValueDistribution = 0.0
    """Added to each measurement of the level, drawn each time."""
    approach_altitude_m: Length = 1.25
    """Altitude above the sea bed at which the station is approached."""
    mission_ends_at_level: Annotated[Real, Within(0.0, lt=1.0)] | None = None
    """Level at or below which the mission ends; by default it continues with an empty battery."""
    resend_period_s: Period = 10.0
    """Period at which the station is sent to the autopilot again as a set-point."""
