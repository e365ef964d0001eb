"""The physical part of a scenario: the vehicle, its start, pipeline, water, signals, battery, and failures.

Values of vehicles with their sources: scenarios/vehicles.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from suave_des.domain import SEA_BED_Z_M, SURFACE_Z_M, THRUSTER_NAMES
from suave_des.errors import line_error, shown
from suave_des.files import read_csv
from suave_des.scenario.quantities import (
    LARGEST,
    LONGEST_S,
    Coordinate,
    CoordinateDistribution,
    CurrentDistribution,
    Distribution,
    Duration,
    HeadingDistribution,
    Length,
    NotNegative,
    Number,
    Period,
    Real,
    Share,
    ShiftDistribution,
    Strict,
    TimeDistribution,
    ValueDistribution,
    Within,
    ordered,
    wrong,
)

Positive = Annotated[Real, Field(gt=0, le=1e6)]
Offset = Coordinate
Component = Annotated[Real, Field(ge=-1, le=1)]
_UNIT_TOLERANCE = 1e-3


class Monitor(Strict):
    """Faults that any monitor can have."""

    dropout_probability: Share = 0.0
    """Probability that a message is lost."""
    outages_s: tuple[tuple[NotNegative, NotNegative], ...] = ()
    """Intervals [from, to] in which every message is lost."""

    @field_validator("outages_s", mode="after")
    @classmethod
    def _are_in_order(cls, value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        for since_s, to_s in value:
            if since_s > to_s:
                raise wrong(f"the outage [{since_s:g}, {to_s:g}] ends before it begins", "give [from, to]")
        return value

    @property
    def loses_messages(self) -> bool:
        """Whether any message can be lost."""
        return self.dropout_probability > 0.0 or bool(self.outages_s)


class _Signal(Monitor):
    publishing_period_s: Period | None = None
    """Period of its monitor; by default the revision's."""
    time_step_s: NotNegative = 1.0
    """Time is truncated to a multiple of this, unless it is 0."""
    noise: ValueDistribution = 0.0
    """Added to each measurement."""


class SinusoidSignal(_Signal):
    """A cosine that starts at its maximum.

    a cos(2 pi (t + shift) / period) + a + minimum, with a = (maximum - minimum) / 2, as in the exemplar.
    """

    kind: Literal["sinusoid"]
    """A cosine between minimum and maximum."""
    period_s: Period
    """Time from one maximum to the next."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value."""
    shift_s: ShiftDistribution = 0.0
    """Phase shift, drawn once per run."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.minimum, self.maximum)
        return self


class ConstantSignal(_Signal):
    """A constant value."""

    kind: Literal["constant"]
    """A constant value."""
    value: ValueDistribution
    """The value, drawn once per run."""


class StepSignal(_Signal):
    """One value until a time, another from then on."""

    kind: Literal["step"]
    """One value until a time, another from then on."""
    time_s: ShiftDistribution
    """Mission time of the step, drawn once per run."""
    before: Number
    """Value before the step."""
    after: Number
    """Value from the step on."""


class TableSignal(_Signal):
    """Values over time from a CSV file."""

    kind: Literal["table"]
    """Values over time from a CSV file."""
    file: Annotated[str, Field(min_length=1)]
    """CSV file."""
    interpolation: Literal["previous", "linear"] = "previous"
    """Between two rows: the earlier row's value, or a straight line."""


SignalDescription = Annotated[SinusoidSignal | ConstantSignal | StepSignal | TableSignal, Field(discriminator="kind")]


class Camera(Strict):
    """The camera, which looks straight down."""

    field_of_view_deg: Annotated[Real, Field(gt=0, lt=180)]
    """Full angle of view in x and y; it also determines the spacing of the search spiral's turns."""

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
    """Mean speed."""
    amplitude_m_per_s: CurrentDistribution = 0.0
    """Amplitude of the oscillation."""
    period_s: Annotated[Real, Field(ge=1, le=LONGEST_S)] = 120.0
    """Time from one maximum of the speed to the next."""
    shift_s: ShiftDistribution = 0.0
    """Added to mission time."""
    direction_rad: HeadingDistribution = 0.0
    """Direction of the flow, from east towards north."""


class Current(Strict):
    """Velocity of the water in the world frame: a constant part, drawn once per run, and one that varies over time."""

    x_m_per_s: CurrentDistribution = 0.0
    """Towards east."""
    y_m_per_s: CurrentDistribution = 0.0
    """Towards north."""
    z_m_per_s: CurrentDistribution = 0.0
    """Upwards."""
    wave: CurrentWaveDescription | None = None
    """An oscillating part: mean + amplitude sin(2 pi (t + shift) / period)."""


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
    z_m: Annotated[Distribution, Within(SEA_BED_Z_M + 0.01, SURFACE_Z_M)] = -18.5
    """Up."""
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
    """Vertices [x, y, z]."""
    points_per_piece: Annotated[int, Field(strict=True, ge=1, le=1000)] = 20
    """Points on each straight piece."""


_TIME = r"[-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|inf)|nan"
_EVENT_TEXT = re.compile(rf"\(\s*([0-9]{{1,9}})\s*,\s*(\w+)\s*,\s*({_TIME})\s*\)", re.ASCII)


class ThrusterEvent(Strict):
    """A failure or recovery of one thruster; also given as the exemplar writes it: "(1,failure,35)"."""

    thruster: Annotated[int, Field(strict=True, ge=1, le=len(THRUSTER_NAMES))]
    """1 to 4: front right, front left, rear right, rear left; 5 and 6: vertical, right and left."""
    event: Literal["failure", "recovery"]
    """What happens to it."""
    recoverable: bool = True
    """Whether f_maintain_motion can recover the thruster."""
    failure_mode: Literal["frozen", "dead"] | None = None
    """A frozen thruster keeps its last thrust, a dead one gives none; by default the revision's."""
    time_s: TimeDistribution
    """From the start or, in revision 2023, from the previous event; drawn once per run."""

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        match = _EVENT_TEXT.fullmatch(value.strip())
        if match is None:
            remedy = "write (THRUSTER,failure or recovery,TIME), as in (1,failure,35)"
            raise wrong(f"{shown(value)} is not a thruster event", remedy)
        return {"thruster": int(match[1]), "event": match[2], "time_s": float(match[3])}


class Battery(Monitor):
    """Battery of revision 1.5: falls linearly from 1.0, recharged at once near the station."""

    discharge_time_s: Duration = 200.0
    """Time from full (1.0) to empty (0.0)."""
    publishing_period_s: Period = 1.0
    """Period of its monitor."""
    station_x_m: Coordinate = -3.0
    """Recharge station, east."""
    station_y_m: Coordinate = -2.0
    """Recharge station, north."""
    station_radius_m: Length = 0.5
    """Half-width of the square in which the vehicle is docked."""
    noise: ValueDistribution = 0.0
    """Added to each measurement."""
    approach_altitude_m: Length = 1.25
    """Altitude at which the station is approached."""
    mission_ends_at_level: Annotated[Real, Field(ge=0, lt=1)] | None = None
    """Level at which the mission ends."""
    docking_check_period_s: Period = 5.0
    """Period at which the station is sent again."""


# Tables of signals.

SignalTable = tuple[tuple[float, ...], tuple[float, ...]]
"""Times in s, strictly increasing, and the value at each."""
_LARGEST = {"t_s": LONGEST_S, "value": LARGEST}
"""Columns of a table, and the greatest magnitude in each."""
_SIZE_LIMIT_BYTES = 20_000_000


def read_table(path: Path) -> tuple[SignalTable, str]:
    """Read the CSV file of a table signal: its times and values, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: another header, a value that is not a finite number, times that do not
            increase, no row.
    """
    remedy = f"write lines of two numbers: {','.join(_LARGEST)}"
    header, rows, digest = read_csv(path, _SIZE_LIMIT_BYTES, remedy)
    if sorted(header) != sorted(_LARGEST):
        problem = f"the columns are {shown(','.join(header))}"
        raise line_error(path, 1, problem, f"the first line must be {','.join(_LARGEST)}")
    table: list[tuple[float, float]] = []
    for line, row in rows:
        try:
            cells = dict(zip(header, map(float, row), strict=True))
        except ValueError:
            raise line_error(path, line, f"{shown(','.join(row))} is not two numbers", remedy) from None
        for column, largest in _LARGEST.items():
            if not abs(cells[column]) <= largest:  # or nan
                problem = f"{column} {cells[column]:g} is out of range"
                raise line_error(path, line, problem, f"must be at least {-largest:g} and at most {largest:g}")
        if table and cells["t_s"] <= table[-1][0]:
            problem = f"t_s {cells['t_s']:g} does not come after {table[-1][0]:g}"
            raise line_error(path, line, problem, "sort the rows, and give each time once")
        table.append((cells["t_s"], cells["value"]))
    if not table:
        raise line_error(path, 1, "has no row under its header", remedy)
    times_s, values = zip(*table, strict=True)
    return (times_s, values), digest
