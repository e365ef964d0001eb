"""The validated description of a mission: everything that determines its result except manager, run
and seed.

Values of vehicles and of the exemplar's revisions, with their sources: scenarios/vehicles,
scenarios/revisions.

Bounds are generous; a value beyond them can only be a slip, or in a different unit: 10 km around
the origin where the pipeline is 60 m away, a current three times that of the strongest tides, a
heading of once round either way, so that degrees are noticed.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from itertools import pairwise
from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    JsonValue,
    Tag,
    field_validator,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from suave_des import domain
from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    SURFACE,
    WATER_VISIBILITY,
)
from suave_des.errors import did_you_mean, line_error, shown
from suave_des.files import read_csv

# Numbers with bounds, and distributions that may replace them.

LARGEST = 1e12
"""Greatest magnitude of a number without bounds of its own, such as a measured value in a unit of
the user's.
"""
LONGEST_S = 1e9
"""Longest time: 31 years, in other words never."""
FARTHEST_M = 10_000.0


class Strict(BaseModel):
    """Base of every part of a scenario: unknown keys and infinite numbers are errors, values never
    change.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def wrong(problem: str, remedy: str, *keys: str) -> PydanticCustomError:
    """A validation error with its remedy; `keys` are those below that do not fit together."""
    return PydanticCustomError(
        "wrong",
        "{problem} ({remedy})",
        {"problem": problem, "remedy": remedy, "keys": " ".join(keys)},
    )


def ordered(low: float, high: float, low_key: str = "minimum", high_key: str = "maximum") -> None:
    """Raise an error, in the words of the keys, if the lower of two bounds is above the other
    one.
    """
    if low > high:
        problem = f"{low_key} {low:g} is above {high_key} {high:g}"
        raise wrong(problem, f"give the smaller one as {low_key}", low_key, high_key)


def in_order(interval: tuple[float, float]) -> tuple[float, float]:
    """Return an interval; raise an error if its ends are not in order."""
    ordered(*interval, "the beginning", "the end")
    return interval


@dataclass(frozen=True)
class Within:
    """Bounds of a number or of what a distribution in its place states; its spread is at most their
    distance.

    Attributes:
        is_floor: whether a distribution must not be able to give values below `ge` either.
        draws_are_cut: whether values that are drawn below `ge` count as `ge`, so that they may be
            stated.
    """

    ge: float
    le: float
    is_floor: bool = False
    draws_are_cut: bool = False

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check what the type's own checks have passed."""
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Bounds of a plain number; JSON Schema does not apply them to mappings."""
        return {**handler(schema), "minimum": self.ge, "maximum": self.le}

    def _least(self, key: str) -> float:
        """Least value that a distribution may state under a key; an empty one is a plain number's."""
        # A normal distribution that is cut at the floor may have its mean below.
        may_be_below = self.draws_are_cut or (self.is_floor and key == "mean")
        return -self.le if key != "" and may_be_below else self.ge

    def _check(self, value: AnyDistribution) -> AnyDistribution:
        low = self.ge
        high = self.le
        for key, part in _stated(value):
            least = self._least(key)
            if not least <= part <= high:
                raise wrong(
                    f"{part:.12g} is out of range",
                    f"must be at least {low:.12g} and at most {high:.12g}",
                    key,
                )
        if isinstance(value, Normal) and value.std > high - low:
            raise wrong(f"{value.std:g} is out of range", f"must be at most {high - low:g}", "std")
        if self.is_floor and support(value)[0] < low:
            raise wrong(
                f"values below {low:g} can be drawn", f"give a minimum that is at least {low:g}"
            )
        if self.draws_are_cut and support(value)[1] < low:
            raise wrong(
                f"only values below {low:g} can be drawn",
                f"give a greatest value that is at least {low:g}",
            )
        return value


Real = Annotated[float, Field(strict=True)]
"""A number written as one: "80" in quotes and true are none."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_.-]*$", max_length=100)]
Number = Annotated[Real, Field(ge=-LARGEST, le=LARGEST)]
NotNegative = Annotated[Real, Field(ge=0, le=LARGEST)]
Probability = Annotated[Real, Field(ge=0, le=1)]
Coordinate = Annotated[Real, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Length = Annotated[Real, Field(gt=0, le=FARTHEST_M)]
Duration = Annotated[Real, Field(gt=0, le=LONGEST_S)]
Period = Annotated[Real, Field(ge=0.001, le=LONGEST_S)]
"""Period of something that happens in mission time; the lower limit keeps a slip from stopping the
clock.
"""


class Drawn(Strict):
    """Base of distributions."""

    shared: Name | None = None
    """Name of a draw that several keys share: distributions of the same kind and width are then
    shifted alike.
    """


class Normal(Drawn):
    """Normal distribution, truncated to [minimum, maximum]."""

    distribution: Literal["normal"]
    """Bell-shaped."""
    mean: Number
    """Mean before truncation."""
    std: NotNegative
    """Standard deviation before truncation."""
    minimum: Number | None = None
    """Smallest value, if any."""
    maximum: Number | None = None
    """Greatest value, if any."""

    @property
    def interval(self) -> tuple[float, float]:
        """Smallest and greatest value, infinite where there is none."""
        low = self.minimum
        high = self.maximum
        return -math.inf if low is None else low, math.inf if high is None else high

    @model_validator(mode="after")
    def _interval_is_likely(self) -> Self:
        low, high = self.interval
        ordered(low, high)
        likely = NormalDist(self.mean, self.std or 1e-300)
        if likely.cdf(high) - likely.cdf(low) < 0.001 and not (
            self.std == 0 and low <= self.mean <= high
        ):
            problem = f"[{low:g}, {high:g}] leaves next to nothing of the distribution"
            raise wrong(
                problem, "move or widen it, or use distribution: uniform", "minimum", "maximum"
            )
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        low, high = self.interval
        while not low <= (value := stream.normalvariate(self.mean, self.std)) <= high:
            pass
        return value


class Uniform(Drawn):
    """Uniform distribution over [minimum, maximum]."""

    distribution: Literal["uniform"]
    """All values between two bounds, with equal density."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.minimum, self.maximum)
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.uniform(self.minimum, self.maximum)


class Exponential(Drawn):
    """Exponential distribution: `minimum` plus an exponential value of the given mean."""

    distribution: Literal["exponential"]
    """Mostly small values, rarely large ones."""
    mean: NotNegative
    """Mean distance from the minimum."""
    minimum: Number = 0.0
    """Smallest value."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return self.minimum + (stream.expovariate(1.0 / self.mean) if self.mean > 0 else 0.0)


class Choice(Drawn):
    """One of the given values, each with equal probability; a value given twice counts twice."""

    distribution: Literal["choice"]
    """One of a list."""
    values: Annotated[tuple[Number, ...], Field(min_length=1)]
    """The values."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.choice(self.values)


AnyDistribution = float | Normal | Uniform | Exponential | Choice


def _tag(value: object) -> str | None:
    if isinstance(value, dict):
        value = value.get("distribution")
        return value if isinstance(value, str) else None
    return getattr(value, "distribution", "number")


Distribution = Annotated[
    Annotated[Real, Tag("number")]
    | Annotated[Normal, Tag("normal")]
    | Annotated[Uniform, Tag("uniform")]
    | Annotated[Exponential, Tag("exponential")]
    | Annotated[Choice, Tag("choice")],
    Discriminator(
        _tag,
        custom_error_type="wrong",
        custom_error_message="{problem}",
        custom_error_context={
            "problem": "is no distribution that is known",
            "remedy": "give a number, or distribution: normal, uniform, exponential or choice",
            "keys": "distribution",
        },
    ),
]

CoordinateDistribution = Annotated[Distribution, Within(-FARTHEST_M, FARTHEST_M)]
HeadingDistribution = Annotated[Distribution, Within(-6.3, 6.3)]
CurrentDistribution = Annotated[Distribution, Within(-10.0, 10.0)]
OffsetDistribution = Annotated[Distribution, Within(-100.0, 100.0)]
DelayDistribution = Annotated[Distribution, Within(0.0, LONGEST_S, is_floor=True)]
TimeDistribution = Annotated[Distribution, Within(0.0, LONGEST_S, draws_are_cut=True)]
"""A time; one that is drawn below 0 counts as 0."""
ShiftDistribution = Annotated[Distribution, Within(-LONGEST_S, LONGEST_S)]
ValueDistribution = Annotated[Distribution, Within(-LARGEST, LARGEST)]


def draw(distribution: AnyDistribution, stream: random.Random) -> float:
    """One value of a distribution; a plain number is its own value and draws nothing from the
    stream.
    """
    return distribution if isinstance(distribution, float | int) else distribution.draw(stream)


def mean(distribution: AnyDistribution) -> float:
    """Mean of a distribution; of a normal one before it is cut."""
    stated = _stated(distribution)
    values = [value for key, value in stated if key == "mean"] or [value for _, value in stated]
    return sum(values) / len(values)


def _stated(distribution: AnyDistribution) -> list[tuple[str, float]]:
    """The values that a scenario states for a distribution, with their keys: itself, its mean,
    bounds, choices.
    """
    match distribution:
        case Normal(mean=middle, minimum=low, maximum=high):
            stated = (("mean", middle), ("minimum", low), ("maximum", high))
            return [(key, value) for key, value in stated if value is not None]
        case Uniform(minimum=low, maximum=high):
            return [("minimum", low), ("maximum", high)]
        case Exponential(minimum=low, mean=distance):
            return [("minimum", low), ("mean", low + distance)]
        case Choice(values=values):
            return [("values", value) for value in values]
        case number:
            return [("", float(number))]


def support(distribution: AnyDistribution) -> tuple[float, float]:
    """Smallest and greatest value that a distribution can give, infinite where nothing limits
    it.
    """
    match distribution:
        case Normal(std=0):
            return distribution.mean, distribution.mean
        case Normal():
            return distribution.interval
        case Exponential():
            return (
                distribution.minimum,
                distribution.minimum if distribution.mean == 0 else math.inf,
            )
        case _:
            values = [value for _, value in _stated(distribution)]
            return min(values), max(values)


# The vehicle, its start, pipeline, water, signals, battery, and failures.

Positive = Annotated[Real, Field(gt=0, le=1e6)]
Component = Annotated[Real, Field(ge=-1, le=1)]


class Monitor(Strict):
    """Faults that any monitor can have."""

    dropout_probability: Probability = 0.0
    """Probability that a message is lost."""
    outages_s: tuple[tuple[NotNegative, NotNegative], ...] = ()
    """Intervals [from, to] in which every message is lost."""

    @field_validator("outages_s", mode="after")
    @classmethod
    def _are_in_order(
        cls, value: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        for since_s, to_s in value:
            if since_s > to_s:
                raise wrong(
                    f"the outage [{since_s:g}, {to_s:g}] ends before it begins", "give [from, to]"
                )
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

    a cos(2 pi (t + shift) / period) + a + minimum, with a = (maximum - minimum) / 2, as in the
    exemplar.
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


SignalDescription = Annotated[
    SinusoidSignal | ConstantSignal | StepSignal | TableSignal, Field(discriminator="kind")
]


class Camera(Strict):
    """The camera, which looks straight down."""

    field_of_view_deg: Annotated[Real, Field(gt=0, lt=180)]
    """Full angle of view in x and y; it also determines the spacing of the search spiral's
    turns.
    """

    @property
    def tangent(self) -> float:
        """Half the width of the view at a distance of 1 m."""
        return math.tan(math.radians(self.field_of_view_deg) / 2.0)


class ThrusterDescription(Strict):
    """One thruster, in the body frame (x forward, y left, z up, origin at the centre of mass)."""

    position_m: tuple[Coordinate, Coordinate, Coordinate]
    """Where it is."""
    direction: tuple[Component, Component, Component]
    """Unit vector of its force at positive command."""

    @field_validator("direction", mode="after")
    @classmethod
    def _is_a_unit_vector(cls, value: Any) -> Any:
        length = math.hypot(*value)
        if abs(length - 1.0) > 1e-3:
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
    centre_of_buoyancy_m: Coordinate
    """Height above the centre of mass at which buoyancy acts."""
    quadratic_drag: tuple[Positive, Positive, Positive, Positive, Positive, Positive]
    """Coefficients c of the drag -c |v| v: surge, sway, heave (N s^2/m^2), roll, pitch, yaw (N m
    s^2).
    """
    thrust_limit_n: Positive
    """Greatest thrust of each thruster, in both directions."""
    thrusters: Annotated[tuple[ThrusterDescription, ...], Field(min_length=6, max_length=6)]
    """The six thrusters, in the order of their numbers."""
    camera: Camera
    """The camera."""


class CurrentWaveDescription(Strict):
    """A current whose speed oscillates: mean + amplitude sin(2 pi (t + shift) / period), in one
    direction.
    """

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
    """Velocity of the water in the world frame: a constant part, drawn once per run, and one that
    varies over time.
    """

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
    """Where the vehicle is placed, in the world frame (x east, y north, z up; the sea bed is the
    plane z = -20).
    """

    x_m: CoordinateDistribution = -17.0
    """East."""
    y_m: CoordinateDistribution = 2.57
    """North."""
    z_m: Annotated[Distribution, Within(domain.SEA_BED_Z_M + 0.01, domain.SURFACE_Z_M)] = -18.5
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
    """A failure or recovery of one thruster; also given as the exemplar writes it:
    "(1,failure,35)".
    """

    thruster: Annotated[int, Field(strict=True, ge=1, le=len(domain.THRUSTER_NAMES))]
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
    def _from_text(cls, value: object) -> object:
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
    """Published level at which the mission ends."""
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
        InputError: with file and line: another header, a value that is not a finite number, times
            that do not increase, no row.
    """
    remedy = f"write lines of two numbers, under the first line {','.join(_LARGEST)}"
    header, rows, digest = read_csv(path, _SIZE_LIMIT_BYTES, remedy)
    if sorted(header) != sorted(_LARGEST):
        raise line_error(path, 1, f"the columns are {shown(','.join(header))}", remedy)
    table: list[tuple[float, float]] = []
    for line, row in rows:
        try:
            cells = dict(zip(header, map(float, row), strict=True))
        except ValueError:
            raise line_error(
                path, line, f"{shown(','.join(row))} is not two numbers", remedy
            ) from None
        for column, largest in _LARGEST.items():
            if not abs(cells[column]) <= largest:  # or nan
                problem = f"{column} {cells[column]:g} is out of range"
                raise line_error(
                    path, line, problem, f"must be at least {-largest:g} and at most {largest:g}"
                )
        if table and cells["t_s"] <= table[-1][0]:
            raise line_error(
                path,
                line,
                f"t_s {cells['t_s']:g} does not come after {table[-1][0]:g}",
                "sort the rows",
            )
        table.append((cells["t_s"], cells["value"]))
    if not table:
        raise line_error(path, 1, "has no row under its header", remedy)
    times_s, values = zip(*table, strict=True)
    return (times_s, values), digest


# Differences between the exemplar's revisions, as data.

Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]


class CoordinatorRevision(Strict):
    """The mission node: how it polls, and what it records."""

    poll_period_s: Period
    """Period of its loop."""
    limit_check_period_s: Annotated[Real, Field(ge=0.001, le=1000)]
    """Period at which the time limit is checked."""
    search_time: Literal["poll", "detection"]
    """Time of the poll that saw the detection, or of the detection itself; truncated to whole
    seconds.
    """
    maintain_motion_per_task: bool
    """Whether maintain_motion is cancelled with each task and requested again with the next."""


class SpiralRevision(Strict):
    """The search function's spiral and its altitude work-around."""

    centre: Literal["origin", "activation", "first_activation"]
    """Centre: the local frame's origin, the position at each activation, or at the first."""
    restarts_on_activation: bool
    """Whether each activation restarts the spiral."""
    resends_on_activation: bool = False
    """Whether a spiral that continues sends its way-point at once, not after ticks_before_resending
    only.
    """
    tick_period_s: Period
    """Period of its timer; at most one way-point is reached per tick."""
    angle_step_rad: Annotated[Real, Field(gt=0, le=6.3)]
    """Angle from one way-point to the next."""
    acceptance_m: Length
    """A way-point is reached when dx, dy and dz are all at most this."""
    ticks_before_resending: Count
    """A way-point that is not reached is sent again after more than this many ticks."""
    initial_altitude_m: Length
    """Altitude above the sea bed before any mode is set."""
    workaround_step_m: Length
    """By this the commanded altitude is lowered each time that only z is not reached."""
    workaround_cleared_on_activation: bool
    """Whether each activation discards earlier lowering."""


class FollowRevision(Strict):
    """The follow function's path."""

    acceptance_m: Length
    """A point is reached when dx and dy are both at most this."""
    altitude_m: Length
    """Altitude above the sea bed."""
    poll_period_s: Period
    """Period at which it checks whether the point is reached."""
    polls_before_resending: Count
    """A point that is not reached is sent again after this many polls."""
    restarts_on_activation: bool
    """Whether an activation restarts the path from its first point."""
    keeps_distance_on_activation: bool = False
    """Whether the distance keeps accumulating over activations, without an interrupted piece."""
    counts_interrupted_piece: bool
    """Whether a deactivation adds the stretch from the last point to the current position."""
    resends_at_each_poll: bool
    """Whether such a point is then sent again at each poll, instead of after as many more."""


class RecoveryRevision(Strict):
    """Thruster recovery in maintain_motion."""

    delay_s: DelayDistribution
    """From the activation to the recovery of the first thruster, drawn each time."""
    thruster_period_s: Period
    """Time from one thruster to the next."""
    survives_deactivation: bool
    """Whether an ongoing recovery continues when the function is deactivated."""


class MonitorsRevision(Strict):
    """Monitors and detection mock-up."""

    thruster_event_times: Literal["after_previous", "after_start"]
    """From what a thruster event's time counts."""
    thruster_check_period_s: Period
    """Period at which the monitor lets at most one thruster event happen that is due."""
    visibility_publishing_period_s: Period
    """Period of signals that do not give their own."""
    detected_point_height_m: Annotated[Real, Field(ge=0, le=FARTHEST_M)]
    """Height above the pipeline's points at which detection looks for them."""


class ThrusterFailureRevision(Strict):
    """How thrusters fail; a failure is published in any case."""

    failure_mode: Literal["frozen", "dead"] = "frozen"
    """What a failed thruster does, unless its event says so: `frozen` keeps its last thrust, `dead`
    gives none.
    """
    effective_from_s: NotNegative = 0.0
    """Before this mission time, failures have no effect."""
    loss_probability: Probability = 0.0
    """Probability of each failure to have no effect; it is published in any case."""


class SetPointRevision(Strict):
    """How functions send set-points to the autopilot."""

    loss_probability: Annotated[Distribution, Within(0.0, 1.0, is_floor=True)]
    """Probability that a set-point is lost, drawn once per run."""
    node_frame_offset_x_m: OffsetDistribution
    """Offset of a node's frame from the simulator's, east; drawn once per node and run."""
    node_frame_offset_y_m: OffsetDistribution
    """The same, north."""
    node_frame_offset_z_m: OffsetDistribution
    """The same, up."""

    @field_validator("loss_probability", mode="after")
    @classmethod
    def _is_less_than_one(cls, value: Any) -> Any:
        if support(value)[1] >= 1:
            raise wrong("values of 1 and more can be drawn", "give a maximum that is less than 1")
        return value


class RandomRevision(Strict):
    """The random manager."""

    on_task_request: bool
    """Whether it also picks a mode on each task request."""
    ungrounds_search_at_detection: bool
    """Whether it sets the search to fd_unground already when the pipeline is detected."""


class MetacontrolRevision(Strict):
    """The metacontrol manager and its task bridge."""

    task_bridge_period_s: NotNegative
    """Tasks reach the reasoner at ticks of this period; 0: at once."""
    objectives_at_launch: tuple[Name, ...]
    """Functions whose objectives exist from launch, besides those of the whole mission."""
    waits_for_first_measurement: bool
    """Whether reasoning waits for the first measurement of each attribute of which a design expects
    a value.
    """
    always_improve: tuple[Name, ...]
    """Functions whose objectives have o_always_improve (1.5); see improve_when_exceeded."""
    improve_when_exceeded: bool
    """Whether an objective is also adapted when a measured value exceeds what its current design
    expects.
    """
    ignores_diagnostics_without_objective: bool
    """Whether diagnostics are ignored while there is no objective."""
    executes_plans_of_removed_objectives: bool = False
    """Whether a cycle that is under way when objectives are removed requests their modes all the
    same.
    """


class Revision(Strict):
    """One revision of the exemplar's software."""

    name: str
    """Name in result files."""
    timers_in_step: tuple[Literal["monitors", "metacontrol"], ...]
    """Timers that start with guided mode; every other one has a random phase."""
    coordinator: CoordinatorRevision
    """The mission node."""
    spiral: SpiralRevision
    """The search function."""
    follow: FollowRevision
    """The follow function."""
    recovery: RecoveryRevision
    """Thruster recovery."""
    monitors: MonitorsRevision
    """Monitors and detection."""
    thruster_failures: ThrusterFailureRevision = ThrusterFailureRevision()
    """How thrusters fail."""
    set_points: SetPointRevision
    """How set-points reach the autopilot."""
    random: RandomRevision
    """The random manager."""
    comparison_operators: dict[str, Literal["<", "<=", ">", ">="]]
    """By attribute to which the ontology gives none: when a measured value is worse than an
    expected one.
    """
    metacontrol: MetacontrolRevision
    """The metacontrol manager."""


# The mission, and what the scenario says about managers and metrics.

FileName = Annotated[str, Field(min_length=1)]
ReasonerName = Literal["cached", "pellet", "owlready2"]
REASONERS: tuple[str, ...] = get_args(ReasonerName)


class MissionFunctions(Strict):
    """Functions that the mission needs in addition to the exemplar's."""

    mission_wide: tuple[Name, ...] = ()
    """Needed from launch to the end."""
    search_pipeline: tuple[Name, ...] = ()
    """Needed by the first task."""
    inspect_pipeline: tuple[Name, ...] = ()
    """Needed by the second task."""


class FunctionSettings(Strict):
    """A user-defined function: its class, and the settings of that class."""

    model_config = ConfigDict(extra="allow")

    node: Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*(:[A-Za-z_]\w*)?$")]
    """Its class, as module:Class or by the name that a package registers."""


class MissionSettings(Strict):
    """The coordinator's time limit, and further functions that its tasks need."""

    time_limit_s: Annotated[Real, Field(gt=0, le=100_000.0)] = 300.0
    """Time at which the mission ends."""
    functions: MissionFunctions = MissionFunctions()
    """Functions needed in addition to the exemplar's."""


class Latencies(Strict):
    """Mission time that the software takes, drawn at every occurrence; never negative."""

    task_start_s: DelayDistribution = 0.0
    """From guided mode to the request of the first task."""
    search_start_s: DelayDistribution = 0.0
    """From the activation of the search to its first set-point; drawn once per run."""
    mode_change_s: DelayDistribution = 0.0
    """From the mode manager's answer until the mode takes effect."""
    inference_s: DelayDistribution = 1.0
    """One analyze and plan step."""


class Calibration(Strict):
    """Parameters of vehicle, autopilot and simulator that the sources do not give, the same for
    every manager.
    """

    position_gain_per_s: Annotated[Real, Field(gt=0, le=100)] = 1.0
    """Horizontal velocity for each metre of position error."""
    jerk_m_per_s3: Annotated[Real, Field(gt=0, le=1000)] = 0.5
    """Jerk of the autopilot's target on its way to a set-point."""
    velocity_gain_per_s: Annotated[Real, Field(gt=0, le=10)] = 4.0
    """Horizontal acceleration for each m/s of velocity error."""
    velocity_integral_gain_per_s2: Annotated[Real, Field(ge=0, le=10)] = 1.2
    """Horizontal acceleration for each metre of the integrated velocity error."""
    heading_frequency_rad_per_s: Annotated[Real, Field(gt=0, le=10)] = 4.5
    """Natural frequency of heading control."""
    heading_integral_gain_per_s3: Annotated[Real, Field(ge=0, le=100)] = 0.0
    """Angular acceleration for each rad s of the integrated heading error."""
    altitude_error_m: OffsetDistribution = 0.0
    """Steady error of the altitude, of unknown cause."""
    drift_x_m: CoordinateDistribution = 0.0
    """Drift to the east before guided mode."""
    drift_y_m: CoordinateDistribution = 0.0
    """The same, north."""
    origin_x_m: OffsetDistribution = 0.0
    """Offset to the east from there to the spiral's centre."""
    origin_y_m: OffsetDistribution = 0.0
    """The same, north."""
    real_time_factor_loss: Annotated[Distribution, Within(0.0, 1000.0, is_floor=True)] = 0.0
    """The simulated world runs 1 / (1 + loss) as fast as the software's clock."""
    reasoning_slowdown: Annotated[Distribution, Within(0.0, 1000.0, is_floor=True)] = 0.0
    """Additional loss while the reasoner runs."""


class ReactionMetric(Strict):
    """Definition of a reaction in revision 1.5 (its metrics node)."""

    visibility_thresholds_m: tuple[Number, ...] = (3.25, 2.25, 1.25)
    """In descending order; the first that is reached decides which altitude is expected."""
    expected_altitudes_m: tuple[Number, ...] = (3.0, 2.0, 1.0)
    """Altitude for each threshold."""
    battery_limit: Number = 0.25
    """Battery level below which the vehicle should recharge."""
    undone_within_s: Duration = 4.0
    """An adaptation reverted within this time counts as undone."""

    @model_validator(mode="after")
    def _paired(self) -> Self:
        paired(self, "visibility_thresholds_m", "expected_altitudes_m")
        thresholds = self.visibility_thresholds_m
        if any(later >= earlier for earlier, later in pairwise(thresholds)):
            problem = f"{list(thresholds)} is not in falling order"
            raise wrong(problem, "give the greatest threshold first", "visibility_thresholds_m")
        return self


class KnowledgeSettings(Strict):
    """The knowledge base."""

    ontologies: Annotated[tuple[FileName, ...], Field(min_length=1)] = ("suave.owl",)
    """Ontology files."""
    rules: tuple[FileName, ...] = ()
    """Files of rules as text; a rule replaces those of the same name in the ontologies."""
    disabled_rules: tuple[Name, ...] = ()
    """Names of rules to disable."""
    values: dict[str, Number] = Field(default_factory=dict)
    """New hasValue of individuals, such as qa_water_visibility_low: 0.5."""
    reasoner: ReasonerName = "cached"
    """Reasoner for analyze; owlready2 is slow."""


def paired(part: Strict, one: str, other: str) -> None:
    """Raise an error unless two lists of a part have the same length."""
    lengths = len(getattr(part, one)), len(getattr(part, other))
    if lengths[0] != lengths[1]:
        raise wrong(
            f"{one} has {lengths[0]} entries, {other} {lengths[1]}",
            "give as many of both",
            other,
            one,
        )


class RandomSettings(Strict):
    """The random manager."""

    adaptation_period_s: Period = 15.0
    """Period at which it picks modes."""


class MetacontrolSettings(Strict):
    """The metacontrol manager."""

    reasoning_period_s: Period = 2.0
    """Period of its MAPE-K loop."""
    first_cycle_s: NotNegative | None = None
    """When its first cycle begins; by default at any time of a period, or in step with the monitors
    in a revision that has it so.
    """


class BehaviourTreeSettings(Strict):
    """The behaviour tree manager of revision 1.5."""

    tick_period_s: Period = 0.1
    """Period at which the tree is ticked."""
    first_tick_s: DelayDistribution = Uniform(distribution="uniform", minimum=0.0, maximum=0.1)
    """When it is first ticked."""
    visibility_thresholds_m: tuple[Number, ...] = (3.25, 2.25, 1.25)
    """Minimum visibility for each of search_modes."""
    search_modes: tuple[str, ...] = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low")
    """Search modes."""
    battery_limit: Number = 0.25
    """Battery level below which bt_extended recharges."""
    records_ticks: bool = False
    """Whether the timeline has each tick with a new outcome."""

    @model_validator(mode="after")
    def _paired(self) -> Self:
        paired(self, "visibility_thresholds_m", "search_modes")
        return self


class ManagerSettings(Strict):
    """Settings of managing subsystems by name; an outside manager finds its own under its own
    name.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, dict[str, JsonValue]] = Field(init=False)

    random: RandomSettings = RandomSettings()
    """The random manager."""
    metacontrol: MetacontrolSettings = MetacontrolSettings()
    """The metacontrol manager."""
    bt: BehaviourTreeSettings = BehaviourTreeSettings()
    """The behaviour tree manager."""

    @model_validator(mode="after")
    def _are_for_managers(self) -> Self:
        others = [name for name in self.model_extra or {} if ":" not in name]
        registered = (
            sorted(point.name for point in entry_points(group=domain.MANAGER_GROUP))
            if others
            else []
        )
        for name in others:
            if name not in registered:
                remedy = (
                    f"{did_you_mean(name, [*type(self).model_fields, *registered])}, module:Class"
                )
                raise wrong(f"there is no manager {shown(name)} with settings", remedy, name)
        return self


FurtherMetric = Literal[
    "adaptations_undone",
    "configurations",
    "reasoning_time_s",
    "area_covered_m2",
    "operational_thrusters",
    "battery_level",
    "recharges",
    "surfacing_time_s",
]
FURTHER_METRICS: tuple[str, ...] = get_args(FurtherMetric)
MetricName = (
    FurtherMetric
    | Literal[
        "mission_duration_s",
        "search_time_s",
        "distance_inspected_m",
        "mean_reaction_time_s",
        "adaptations",
        "detection_time_s",
    ]
)


class Requirement(Strict):
    """A requirement that may be partially satisfied, as in RELAX (Whittle et al., Requirements
    Engineering 15, 2010).

    Exactly one of `metric` and `attribute` is given. Satisfaction is 1 if the value is as required.
    Where it is off by d, it is 1 - d / tolerance, at least 0, or exp(-d / tolerance).
    """

    metric: MetricName | None = None
    """A metric."""
    attribute: str | None = None
    """Instead, a measured quality attribute; satisfaction is the mean over time."""
    relation: Literal["at_least", "at_most", "close_to"]
    """Required relation of the value to that below."""
    value: Number
    """The required value."""
    tolerance: NotNegative = 0.0
    """Tolerated deviation from it; 0: none."""
    decay: Literal["linear", "exponential"] = "linear"
    """Satisfaction falls in a line to 0 at the tolerance, or exponentially, to 0.37 there."""

    @model_validator(mode="after")
    def _is_about_one_thing(self) -> Self:
        if (self.metric is None) == (self.attribute is None):
            raise wrong(
                "is about no value, or about two", "give either metric or attribute", "metric"
            )
        return self

    def satisfaction(self, value: float) -> float:
        """Compute the degree to which a value satisfies the requirement, from 0 to 1."""
        off = value - self.value
        if self.relation == "at_least":
            gap = -off
        elif self.relation == "at_most":
            gap = off
        else:
            gap = abs(off)
        if gap <= 0.0:
            return 1.0
        if self.tolerance == 0.0:
            return 0.0
        if self.decay == "exponential":
            return math.exp(-gap / self.tolerance)
        return max(0.0, 1.0 - gap / self.tolerance)


_DEFAULT_MODES = {GENERATE_SEARCH_PATH: "fd_spiral_low", FOLLOW_PIPELINE: "fd_follow_pipeline"}


class Scenario(Strict):
    """One mission's world, vehicle, software and knowledge."""

    name: Name
    """Name in result files; by default that of the file."""
    description: str = ""
    """For people."""
    revision: Revision
    """Behaviour of the exemplar's software in one revision."""
    vehicle: VehicleDescription
    """Body, thrusters and camera; in a file by default `bluerov2`."""
    mission: MissionSettings = MissionSettings()
    """Time limit, and further functions that the tasks need."""
    start: Start = Start()
    """Pose before the drift; each component is drawn once per run."""
    pipeline: Pipeline = Pipeline()
    """The pipeline on the sea bed."""
    current: Current = Current()
    """Velocity of the water in the world frame, drawn once per run."""
    signals: dict[Name, SignalDescription]
    """Measured signals, by quality attribute; water_visibility (m) is required."""
    thruster_events: tuple[ThrusterEvent, ...] = ()
    """Failures and recoveries, in order; also as in the exemplar: "(1,failure,35)"."""
    thruster_monitor: Monitor = Monitor()
    """Faults of the thruster monitor; the battery and each signal have the same keys."""
    battery: Battery | None = None
    """The battery: falls linearly from 1.0, and is recharged at once near the station."""
    leak: Leak | None = None
    """The vehicle abandons its tasks and surfaces. Needs f_surface in modes file and ontology."""
    latencies: Latencies = Latencies()
    """Mission time that the software takes, drawn at every occurrence."""
    calibration: Calibration = Calibration()
    """Fitted parameters, drawn once per run."""
    modes_file: FileName = "suave_modes.yaml"
    """System Modes file."""
    default_modes: dict[Name, str] = Field(default_factory=lambda: dict(_DEFAULT_MODES))
    """Mode of a function that a manager sets where it does not choose one: `none` always, others
    but metacontrol of functions that they do not adapt."""
    functions: dict[Name, FunctionSettings] = Field(default_factory=dict)
    """User-defined functions, by their name in the modes file."""
    knowledge: KnowledgeSettings = KnowledgeSettings()
    """The knowledge base."""
    managers: ManagerSettings = ManagerSettings()
    """Settings of managing subsystems, by name."""
    reaction_metric: ReactionMetric = ReactionMetric()
    """Definition of a reaction, as in revision 1.5."""
    metrics: Annotated[tuple[FurtherMetric, ...], Field(max_length=len(FURTHER_METRICS))] = ()
    """Each has a column of its own."""
    requirements: dict[Name, Requirement] = Field(default_factory=dict)
    """Requirements that may be partially satisfied, as in RELAX (Whittle et al., Requirements
    Engineering 15, 2010). The column requirement_NAME falls from 1 towards 0 where the value is
    off."""

    @field_validator("signals", mode="after")
    @classmethod
    def _visibility_is_there(cls, value: dict[str, object]) -> dict[str, object]:
        if WATER_VISIBILITY not in value:
            raise wrong(
                "there is no signal named water_visibility",
                "add it: the pipeline's detection needs it",
            )
        return value

    @field_validator("default_modes", mode="after")
    @classmethod
    def _over_the_defaults(cls, value: dict[str, str]) -> dict[str, str]:
        return {**_DEFAULT_MODES, **value}

    def default_mode(self, function: str) -> str | None:
        """The mode of a function under a manager that does not choose one; None: there is none."""
        return self.default_modes.get(
            function, domain.SURFACE_MODE if function == SURFACE else None
        )

    def needed_functions(self) -> tuple[str, ...]:
        """The functions that the mission needs."""
        own = self.mission.functions
        surface = (SURFACE,) if self.leak is not None else ()
        tasks = *own.search_pipeline, *own.inspect_pipeline
        return tuple(
            dict.fromkeys((*domain.MISSION_FUNCTIONS, *own.mission_wide, *tasks, *surface))
        )

    def without_effect(self) -> Iterator[str]:
        """Yield what changes no mission, and why, in words: a failure that comes too early, or what
        comes too late.
        """
        failures = self.revision.thruster_failures
        effective_s = failures.effective_from_s
        times_s: dict[str, float] = {}
        spans_s = zip(self.thruster_events, self._event_spans_s(), strict=True)
        for number, (event, (earliest_s, latest_s)) in enumerate(spans_s):
            times_s[f"thruster_events.{number}"] = earliest_s
            if event.event == "failure" and latest_s <= effective_s:
                key = "revision.thruster_failures.effective_from_s"
                yield f"thruster_events.{number}: failures have no effect before {effective_s:g} s ({key})"
            elif event.event == "failure" and failures.loss_probability == 1.0:
                key = "revision.thruster_failures.loss_probability"
                yield f"thruster_events.{number}: each failure is lost ({key} is 1)"
        for name, each in self.signals.items():
            if each.kind == "step":
                times_s[f"signals.{name}"] = support(each.time_s)[0]
        if self.leak is not None:
            times_s["leak"] = support(self.leak.time_s)[0]
        for key, time_s in times_s.items():
            if time_s >= self.mission.time_limit_s:
                limit = f"mission.time_limit_s is {self.mission.time_limit_s:g} s"
                yield f"{key}: {time_s:g} s is after the end of each mission ({limit})"

    def _event_spans_s(self) -> Iterator[tuple[float, float]]:
        """Yield the earliest and the latest time of each thruster event."""
        monitors = self.revision.monitors
        earliest_s = latest_s = 0.0
        for event in self.thruster_events:
            low_s, high_s = (max(0.0, bound) for bound in support(event.time_s))
            if monitors.thruster_event_times == "after_previous":
                low_s += earliest_s
                high_s += latest_s
            earliest_s = max(earliest_s, low_s)
            latest_s = max(latest_s, high_s) + monitors.thruster_check_period_s
            yield earliest_s, latest_s

    def reasoning_share(self) -> float:
        """Share of the time in which metacontrol's reasoner runs: one inference in each of its
        periods.
        """
        return min(
            1.0, mean(self.latencies.inference_s) / self.managers.metacontrol.reasoning_period_s
        )

    @property
    def further_columns(self) -> tuple[str, ...]:
        """Columns of runs.csv that this scenario has besides those of all."""
        return (*self.metrics, *(f"requirement_{name}" for name in self.requirements))

    @model_validator(mode="after")
    def _metrics_have_what_they_are_of(self) -> Self:
        for index, metric in enumerate(self.metrics):
            if metric in self.metrics[:index]:
                raise wrong(f"{metric} is given twice", "name each metric once", "metrics")
        needed = {*self.metrics, *(each.metric for each in self.requirements.values())}
        if self.leak is None and "surfacing_time_s" in needed:
            raise wrong("surfacing_time_s needs a leak", "add leak: {time_s: 100}", "metrics")
        for of_battery in (BATTERY_LEVEL, "recharges"):
            if self.battery is None and of_battery in needed:
                raise wrong(f"{of_battery} needs a battery", "add battery: {}", "metrics")
        return self

    @model_validator(mode="after")
    def _attributes_are_measured_once(self) -> Self:
        measured = {*self.signals, *((BATTERY_LEVEL,) if self.battery is not None else ())}
        for name, each in self.requirements.items():
            if each.attribute is not None and each.attribute not in measured:
                raise wrong(
                    f"nothing measures {each.attribute} ({name})",
                    "add a signal of that name",
                    "requirements",
                )
        if self.battery is not None and BATTERY_LEVEL in self.signals:
            raise wrong(
                "there are a battery and a signal battery_level", "remove one of them", "battery"
            )
        return self
