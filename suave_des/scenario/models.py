"""The validated description of a mission: everything that decides a result but manager, run and seed."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import ConfigDict, Field, field_validator, model_validator

from suave_des.domain import (
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    MISSION_FUNCTIONS,
    SEA_BED_Z_M,
    SURFACE,
    SURFACE_MODE,
    SURFACE_Z_M,
)
from suave_des.errors import shown
from suave_des.scenario.additions import Current, FunctionSettings, Leak, MissionFunctions
from suave_des.scenario.evaluation import Metrics, Requirement
from suave_des.scenario.quantities import (
    Coordinate,
    CoordinateDistribution,
    DelayDistribution,
    Distribution,
    Duration,
    HeadingDistribution,
    Length,
    Name,
    Number,
    OffsetDistribution,
    Period,
    Strict,
    TimeDistribution,
    ValueDistribution,
    Within,
    wrong,
)
from suave_des.scenario.revision import Revision
from suave_des.scenario.signal_kinds import Monitor, Signal
from suave_des.scenario.vehicle import VehicleDescription

FileName = Annotated[str, Field(min_length=1)]

Reasoner = Literal["remembered", "pellet", "owlready2"]
REASONERS: tuple[str, ...] = get_args(Reasoner)

THRUSTERS = 6
_LONGEST_MISSION_S = 100_000.0


class Mission(Strict):
    """The coordinator's limit, and what its tasks need."""

    time_limit_s: Annotated[float, Field(strict=True), Within(gt=0, le=_LONGEST_MISSION_S, unit="s")] = 300.0
    """When the current task is cancelled and the metrics are taken."""
    functions: MissionFunctions = MissionFunctions()
    """Functions that are needed besides the exemplar's."""


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
    """Whether f_maintain_motion can bring the thruster back after this failure."""
    time_s: TimeDistribution
    """When, drawn once a run; the revision decides whether after the start or after the event before. Below 0 is 0."""

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
    """Added to each measurement of the level, drawn anew each time."""
    approach_altitude_m: Length = 1.25
    """Altitude above the sea bed at which the station is approached."""
    mission_ends_at_level: Annotated[float, Field(strict=True), Within(0.0, lt=1.0)] | None = None
    """Level at which, or below which, the mission ends; left out: it goes on with an empty battery."""
    resend_period_s: Period = 10.0
    """Period at which the station is sent to the autopilot again."""


class Latencies(Strict):
    """Mission time that software takes, drawn anew at every occurrence; never negative."""

    task_start_s: DelayDistribution = 0.0
    """From guided mode to the request of the first task."""
    guided_start_s: DelayDistribution = 0.0
    """From guided mode to the moment at which the search node has noticed it and sends set-points."""
    mode_change_s: DelayDistribution = 0.0
    """From the mode manager's answer to the mode's effect."""
    inference_s: DelayDistribution = 1.0
    """One analyze and plan (stock Pellet starts a Java machine for each)."""


class Calibration(Strict):
    """Parameters of vehicle, autopilot and simulator that the sources leave open, alike for every manager."""

    position_gain_per_s: Annotated[float, Field(strict=True), Within(gt=0, le=100, unit="1/s")] = 1.0
    """Horizontal velocity demanded for each metre of position error; ArduSub's default."""
    jerk_m_per_s3: Annotated[float, Field(strict=True), Within(gt=0, le=1000, unit="m/s^3")] = 0.5
    """Jerk with which the autopilot's target moves along a leg to a set-point."""
    velocity_gain_per_s: Annotated[float, Field(strict=True), Within(gt=0, le=10, unit="1/s")] = 4.0
    """Horizontal acceleration demanded for each m/s of velocity error."""
    velocity_integral_gain_per_s2: Annotated[float, Field(strict=True), Within(0, 10, unit="1/s^2")] = 1.2
    """Horizontal acceleration demanded for each metre that the velocity error sums up to; each new leg starts anew."""
    heading_frequency_rad_per_s: Annotated[float, Field(strict=True), Within(gt=0, le=10, unit="rad/s")] = 4.5
    """Natural frequency of heading control."""
    heading_integral_gain_per_s3: Annotated[float, Field(strict=True), Within(0, 100, unit="1/s^3")] = 0.0
    """Angular acceleration demanded for each rad s that the heading error sums up to."""
    altitude_error_m: OffsetDistribution = 0.0
    """Steady error of the held altitude whose cause is not explained, drawn once a run: set-point plus this."""
    drift_x_m: CoordinateDistribution = 0.0
    """Way east from the start to where guided mode begins, drawn once a run."""
    drift_y_m: CoordinateDistribution = 0.0
    """The same, north."""
    origin_x_m: OffsetDistribution = 0.0
    """Way east from where guided mode begins to the local frame's origin, the spiral's centre; drawn once a run."""
    origin_y_m: OffsetDistribution = 0.0
    """The same, north."""
    real_time_factor_loss: Annotated[Distribution, Within(0.0, 1000.0, is_floor=True)] = 0.0
    """The simulated world runs 1 / (1 + loss) as fast as the software's clock; drawn once a run."""


class ReactionMetric(Strict):
    """What revision 1.5 calls a reaction (its metrics node)."""

    visibility_thresholds_m: tuple[Number, ...] = (3.25, 2.25, 1.25)
    """Falling visibilities; the first that is reached decides which altitude fits."""
    expected_altitudes_m: tuple[Number, ...] = (3.0, 2.0, 1.0)
    """Fitting altitude for each threshold."""
    battery_limit: Number = 0.25
    """Battery level below which the recharge path is expected to become active."""
    undone_within_s: Duration = 4.0
    """An adaptation that is taken back within this time is undone; two cycles of metacontrol in revision 2023."""

    @model_validator(mode="after")
    def _paired(self) -> Self:
        paired(self, "visibility_thresholds_m", "expected_altitudes_m")
        thresholds = self.visibility_thresholds_m
        if any(later >= earlier for earlier, later in pairwise(thresholds)):
            problem = f"{list(thresholds)} is not in falling order"
            raise wrong(problem, "give the greatest threshold first", "visibility_thresholds_m")
        return self


class Knowledge(Strict):
    """The knowledge base."""

    ontologies: Annotated[tuple[FileName, ...], Field(min_length=1)] = ("suave.owl",)
    """Ontology files; what they import is resolved through the catalogue beside them."""
    rules: tuple[FileName, ...] = ()
    """Files of rules as text; a rule takes the place of those of its name in the ontologies."""
    disabled_rules: tuple[Name, ...] = ()
    """Rules to switch off, by name."""
    values: dict[str, Number] = Field(default_factory=dict)
    """New value (hasValue) of named individuals of QAvalue, such as qa_water_visibility_low: 0.5."""
    reasoner: Reasoner = "remembered"
    """Which reasoner analyzes; owlready2 is the reference, and slow."""


def paired(part: Strict, one: str, other: str) -> None:
    """Raise an error unless two lists of a part have the same length."""
    lengths = len(getattr(part, one)), len(getattr(part, other))
    if lengths[0] != lengths[1]:
        raise wrong(f"{one} has {lengths[0]} entries, {other} {lengths[1]}", "give as many of both", other, one)


class RandomSettings(Strict):
    """The random manager."""

    adaptation_period_s: Period = 15.0
    """Period at which it picks modes."""


class MetacontrolSettings(Strict):
    """The metacontrol manager."""

    reasoning_period_s: Period = 2.0
    """Period of its MAPE-K loop."""


class BehaviourTreeSettings(Strict):
    """The behaviour tree manager of revision 1.5."""

    tick_period_s: Period = 0.1
    """Period at which the tree is ticked."""
    visibility_thresholds_m: tuple[Number, ...] = (3.25, 2.25, 1.25)
    """Visibility from which on each of search_modes is chosen; the first that is reached wins."""
    search_modes: tuple[str, ...] = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low")
    """Search modes, one for each threshold."""
    battery_limit: Number = 0.25
    """Battery level below which the extended tree goes to recharge."""
    records_ticks: bool = False
    """Whether the timeline of a recorded mission has each tick that came to something else than the one before."""

    @model_validator(mode="after")
    def _paired(self) -> Self:
        paired(self, "visibility_thresholds_m", "search_modes")
        return self


class ManagerSettings(Strict):
    """Settings of managing subsystems by name; an outside manager finds its own under its own name."""

    model_config = ConfigDict(extra="allow")

    random: RandomSettings = RandomSettings()
    """The random manager."""
    metacontrol: MetacontrolSettings = MetacontrolSettings()
    """The metacontrol manager."""
    bt: BehaviourTreeSettings = BehaviourTreeSettings()
    """The behaviour tree manager."""


_DEFAULT_MODES = {GENERATE_SEARCH_PATH: "fd_spiral_low", FOLLOW_PIPELINE: "fd_follow_pipeline"}


class Scenario(Strict):
    """One mission's world, vehicle, software and knowledge."""

    name: Name
    """Name in result files. In a YAML file: left out, the file's name without its ending."""
    description: str = ""
    """For people."""
    revision: Revision
    """How the exemplar's software of one revision behaves."""
    vehicle: VehicleDescription
    """Body, thrusters and camera; left out in a file: `bluerov2`."""
    mission: Mission = Mission()
    """The coordinator's limit, and what its tasks need."""
    start: Start = Start()
    """Pose before the drift, each part drawn once a run."""
    pipeline: Pipeline = Pipeline()
    """The pipeline on the sea bed."""
    current: Current = Current()
    """Velocity of the water."""
    signals: dict[Name, Signal]
    """What is measured, by the name of its quality attribute; water_visibility (m) is needed."""
    thruster_events: tuple[ThrusterEvent, ...] = ()
    """Failures and recoveries, in order."""
    thruster_monitor: Monitor = Monitor()
    """What is wrong with the monitor of the thrusters."""
    battery: Battery | None = None
    """The battery; left out: there is none."""
    leak: Leak | None = None
    """A leak; left out: there is none. It needs a function f_surface in the modes file, and designs of it."""
    latencies: Latencies = Latencies()
    """Times that software takes."""
    calibration: Calibration = Calibration()
    """What the sources leave open."""
    modes_file: FileName = "suave_modes.yaml"
    """System Modes file."""
    default_modes: dict[Name, str] = Field(default_factory=lambda: dict(_DEFAULT_MODES))
    """Mode that the manager none sets for each function; functions left out keep their default."""
    functions: dict[Name, FunctionSettings] = Field(default_factory=dict)
    """Functions of one's own, by the name that they have in the modes file."""
    knowledge: Knowledge = Knowledge()
    """The knowledge base."""
    managers: ManagerSettings = ManagerSettings()
    """Settings of managing subsystems, by name; an outside manager finds its own under its own name."""
    reaction_metric: ReactionMetric = ReactionMetric()
    """What counts as a reaction."""
    metrics: Metrics = ()
    """Further metrics, each with a column of its own; see [further metrics](csv.md#further-metrics)."""
    requirements: dict[Name, Requirement] = Field(default_factory=dict)
    """Requirements by name; how far each is fulfilled is a column, requirement_NAME."""

    @field_validator("signals", mode="after")
    @classmethod
    def _visibility_is_there(cls, value: dict[str, Any]) -> dict[str, Any]:
        if "water_visibility" not in value:
            raise wrong("there is no signal named water_visibility", "add it: the pipeline's detection needs it")
        return value

    @field_validator("default_modes", mode="after")
    @classmethod
    def _over_the_defaults(cls, value: dict[str, str]) -> dict[str, str]:
        return {**_DEFAULT_MODES, **value}

    def default_mode(self, function: str) -> str | None:
        """The mode that the manager none sets for a function."""
        return self.default_modes.get(function, SURFACE_MODE if function == SURFACE else None)

    def needed_functions(self) -> tuple[str, ...]:
        """The functions that the mission needs."""
        own, surface = self.mission.functions, (SURFACE,) if self.leak is not None else ()
        return tuple(
            dict.fromkeys((*MISSION_FUNCTIONS, *own.lasting, *own.search_pipeline, *own.inspect_pipeline, *surface))
        )

    @property
    def further_columns(self) -> tuple[str, ...]:
        """Columns of runs.csv that this scenario has besides those of all."""
        return (*self.metrics, *(f"requirement_{name}" for name in self.requirements))

    @model_validator(mode="after")
    def _metrics_fit(self) -> Self:
        for index, metric in enumerate(self.metrics):
            if metric in self.metrics[:index]:
                raise wrong(f"{metric} is given twice", "name each metric once", "metrics")
        needed = {*self.metrics, *(each.metric for each in self.requirements.values())}
        if self.leak is None and "surfacing_time_s" in needed:
            raise wrong("surfacing_time_s needs a leak", "add leak: {time_s: 100}", "metrics")
        if self.battery is None and (missing := [each for each in ("battery_level", "recharges") if each in needed]):
            raise wrong(f"{missing[0]} needs a battery", "add battery: {}", "metrics")
        measured = {*self.signals, *(("battery_level",) if self.battery is not None else ())}
        for name, each in self.requirements.items():
            if each.attribute is not None and each.attribute not in measured:
                raise wrong(f"nothing measures {each.attribute} ({name})", "add a signal of that name", "requirements")
        return self

    @model_validator(mode="after")
    def _one_battery(self) -> Self:
        if self.battery is not None and "battery_level" in self.signals:
            raise wrong("there are a battery and a signal battery_level", "remove one of them", "battery")
        return self
