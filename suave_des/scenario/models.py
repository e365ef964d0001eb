"""The validated description of a mission: everything that determines its result except manager, run and seed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from importlib.metadata import entry_points
from itertools import pairwise
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, ConfigDict, Field, field_validator, model_validator

from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    MANAGER_GROUP,
    MISSION_FUNCTIONS,
    SURFACE,
    SURFACE_MODE,
    WATER_VISIBILITY,
)
from suave_des.errors import did_you_mean, shown
from suave_des.scenario.physical import (
    Battery,
    Current,
    Leak,
    Monitor,
    Pipeline,
    SignalDescription,
    Start,
    ThrusterEvent,
    VehicleDescription,
)
from suave_des.scenario.quantities import (
    CoordinateDistribution,
    DelayDistribution,
    Distribution,
    Duration,
    Name,
    NotNegative,
    Number,
    OffsetDistribution,
    Period,
    Real,
    Strict,
    Uniform,
    Within,
    mean,
    support,
    wrong,
)
from suave_des.scenario.revision import Revision

FileName = Annotated[str, Field(min_length=1)]

ReasonerName = Literal["cached", "pellet", "owlready2"]
REASONERS: tuple[str, ...] = get_args(ReasonerName)

_LONGEST_MISSION_S = 100_000.0


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

    time_limit_s: Annotated[Real, Field(gt=0, le=_LONGEST_MISSION_S)] = 300.0
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
    """Parameters of vehicle, autopilot and simulator that the sources do not give, the same for every manager."""

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


def _finite(value: Any) -> Any:
    """Check that no number in a manager's settings is infinite or none at all."""
    if isinstance(value, float) and not math.isfinite(value):
        raise wrong(f"{shown(value)} is not finite", "give a finite number")
    for each in value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ():
        _finite(each)
    return value


class ManagerSettings(Strict):
    """Settings of managing subsystems by name; an outside manager finds its own under its own name."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Annotated[dict[str, Any], AfterValidator(_finite)]] = Field(init=False)

    random: RandomSettings = RandomSettings()
    """The random manager."""
    metacontrol: MetacontrolSettings = MetacontrolSettings()
    """The metacontrol manager."""
    bt: BehaviourTreeSettings = BehaviourTreeSettings()
    """The behaviour tree manager."""

    @model_validator(mode="after")
    def _are_for_managers(self) -> Self:
        others = [name for name in self.model_extra or {} if ":" not in name]
        registered = sorted(point.name for point in entry_points(group=MANAGER_GROUP)) if others else []
        for name in others:
            if name not in registered:
                remedy = f"{did_you_mean(name, [*type(self).model_fields, *registered])}, module:Class"
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
Metric = (
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
    """A requirement that may be partially satisfied, as in RELAX (Whittle et al., Requirements Engineering 15, 2010).

    Exactly one of `metric` and `attribute` is given. Satisfaction is 1 if the value is as required, and falls
    linearly to 0 when it is off by the tolerance.
    """

    metric: Metric | None = None
    """A metric."""
    attribute: str | None = None
    """Instead, a measured quality attribute; satisfaction is the mean over time."""
    relation: Literal["at_least", "at_most", "close_to"]
    """Required relation of the value to that below."""
    value: Number
    """The required value."""
    tolerance: NotNegative = 0.0
    """Tolerated deviation from it."""

    @model_validator(mode="after")
    def _is_about_one_thing(self) -> Self:
        if (self.metric is None) == (self.attribute is None):
            raise wrong("is about no value, or about two", "give either metric or attribute", "metric")
        return self

    def satisfaction(self, value: float) -> float:
        """Compute the degree to which a value satisfies the requirement, from 0 to 1."""
        off = value - self.value
        gap = {"at_least": -off, "at_most": off, "close_to": abs(off)}[self.relation]
        if gap <= 0.0:
            return 1.0
        return max(0.0, 1.0 - gap / self.tolerance) if self.tolerance > 0.0 else 0.0


Metrics = Annotated[tuple[FurtherMetric, ...], Field(max_length=len(FURTHER_METRICS))]

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
    """Mode that the manager none sets, by function."""
    functions: dict[Name, FunctionSettings] = Field(default_factory=dict)
    """User-defined functions, by their name in the modes file."""
    knowledge: KnowledgeSettings = KnowledgeSettings()
    """The knowledge base."""
    managers: ManagerSettings = ManagerSettings()
    """Settings of managing subsystems, by name."""
    reaction_metric: ReactionMetric = ReactionMetric()
    """Definition of a reaction, as in revision 1.5."""
    metrics: Metrics = ()
    """Each has a column of its own."""
    requirements: dict[Name, Requirement] = Field(default_factory=dict)
    """Requirements that may be partially satisfied, as in RELAX (Whittle et al., Requirements Engineering 15,
    2010). The column requirement_NAME falls from 1 to 0 where the value is off by the tolerance."""

    @field_validator("signals", mode="after")
    @classmethod
    def _visibility_is_there(cls, value: dict[str, Any]) -> dict[str, Any]:
        if WATER_VISIBILITY not in value:
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
            dict.fromkeys(
                (*MISSION_FUNCTIONS, *own.mission_wide, *own.search_pipeline, *own.inspect_pipeline, *surface)
            )
        )

    def without_effect(self) -> Iterator[str]:
        """Yield what changes no mission, and why, in words: a failure that comes too early, or what comes too late."""
        monitors, earliest_s, latest_s = self.revision.monitors, 0.0, 0.0
        effective_s = self.revision.thruster_failures.effective_from_s
        times_s: dict[str, float] = {}
        for number, event in enumerate(self.thruster_events):
            low_s, high_s = (max(0.0, bound) for bound in support(event.time_s))
            if monitors.thruster_event_times == "after_previous":
                low_s, high_s = low_s + earliest_s, high_s + latest_s
            earliest_s = max(earliest_s, low_s)
            latest_s = max(latest_s, high_s) + monitors.thruster_check_period_s
            times_s[f"thruster_events.{number}"] = earliest_s
            if event.event == "failure" and latest_s <= effective_s:
                key = "revision.thruster_failures.effective_from_s"
                yield f"thruster_events.{number}: failures have no effect before {effective_s:g} s ({key})"
        later = {f"signals.{name}": each.time_s for name, each in self.signals.items() if each.kind == "step"}
        later |= {} if self.leak is None else {"leak": self.leak.time_s}
        times_s |= {key: support(time_s)[0] for key, time_s in later.items()}
        for key, time_s in times_s.items():
            if time_s >= self.mission.time_limit_s:
                limit = f"mission.time_limit_s is {self.mission.time_limit_s:g} s"
                yield f"{key}: {time_s:g} s is after the end of each mission ({limit})"

    def reasoning_share(self) -> float:
        """Share of the time in which metacontrol's reasoner runs: one inference in each of its periods."""
        return min(1.0, mean(self.latencies.inference_s) / self.managers.metacontrol.reasoning_period_s)

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
        if self.battery is None and (missing := [each for each in (BATTERY_LEVEL, "recharges") if each in needed]):
            raise wrong(f"{missing[0]} needs a battery", "add battery: {}", "metrics")
        measured = {*self.signals, *((BATTERY_LEVEL,) if self.battery is not None else ())}
        for name, each in self.requirements.items():
            if each.attribute is not None and each.attribute not in measured:
                raise wrong(f"nothing measures {each.attribute} ({name})", "add a signal of that name", "requirements")
        return self

    @model_validator(mode="after")
    def _one_battery(self) -> Self:
        if self.battery is not None and BATTERY_LEVEL in self.signals:
            raise wrong("there are a battery and a signal battery_level", "remove one of them", "battery")
        return self
