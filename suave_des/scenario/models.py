"""The validated description of a mission: everything that decides a result, apart from manager, run and seed."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Discriminator, Field, Tag, field_validator, model_validator

from suave_des.scenario.distributions import Distribution, Strict, lower_bound
from suave_des.scenario.revision import NotNegative, Positive, Revision

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_.-]*$", max_length=100)]


def _not_negative(value: Any) -> Any:
    if lower_bound(value) < 0:
        raise ValueError("must never be negative: give a number >= 0 or a distribution with minimum >= 0")
    return value


class Mission(Strict):
    """The coordinator's task list and limit."""

    time_limit_s: Positive = 300.0


class Start(Strict):
    """Pose at t = 0, in the world frame (x east, y north, z up; the sea bed is the plane z = -20)."""

    x_m: Distribution = -17.0
    y_m: Distribution = 2.57
    z_m: Distribution = -18.5
    heading_rad: Distribution = 0.0


class Current(Strict):
    """Velocity of the water in the world frame, constant over a run."""

    x_m_per_s: Distribution = 0.0
    y_m_per_s: Distribution = 0.0
    z_m_per_s: Distribution = 0.0


class Pipeline(Strict):
    """Vertices of the pipeline, in order; each straight piece is sampled at evenly spaced points."""

    vertices_m: Annotated[tuple[tuple[float, float, float], ...], Field(min_length=2)] = (
        (-15.0, 0.0, -20.0),
        (-25.0, 0.0, -20.0),
        (-35.0, 0.0, -20.0),
        (-37.41, -1.0, -20.0),
        (-44.49, -8.07, -20.0),
        (-51.56, -15.14, -20.0),
    )
    """The default is the exemplar's pipeline (kas-lab/suave)."""
    points_per_piece: Annotated[int, Field(ge=1, le=1000)] = 20


class _Signal(Strict):
    publishing_period_s: Positive | None = None
    """Period of the monitor that measures it; none: the revision's."""
    time_step_s: NotNegative = 1.0
    """Time is cut to multiples of this before the signal is evaluated (whole seconds in the exemplar); 0: not cut."""
    noise: Distribution = 0.0
    """Added to each measurement, drawn anew each time."""


class SinusoidSignal(_Signal):
    """a cos(2 pi (t + shift) / period) + a + minimum, with a = (maximum - minimum) / 2: it starts at its maximum."""

    kind: Literal["sinusoid"]
    period_s: Positive
    minimum: float
    maximum: float
    shift_s: Distribution = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise ValueError(f"minimum {self.minimum} is above maximum {self.maximum}")
        return self


class ConstantSignal(_Signal):
    """The same value all the time."""

    kind: Literal["constant"]
    value: Distribution


class StepSignal(_Signal):
    """`before` until `time_s`, `after` from then on."""

    kind: Literal["step"]
    time_s: Distribution
    before: float
    after: float


class TableSignal(_Signal):
    """Values over time from a CSV file with columns t_s and value."""

    kind: Literal["table"]
    file: str
    interpolation: Literal["previous", "linear"] = "previous"


Signal = Annotated[
    Annotated[SinusoidSignal, Tag("sinusoid")]
    | Annotated[ConstantSignal, Tag("constant")]
    | Annotated[StepSignal, Tag("step")]
    | Annotated[TableSignal, Tag("table")],
    Discriminator(
        "kind",
        custom_error_type="signal_kind",
        custom_error_message="must be a mapping with kind: sinusoid, constant, step or table",
    ),
]

_EVENT_TEXT = re.compile(r"^\(\s*(?P<thruster>[^,]*?)\s*,\s*(?P<event>[^,]*?)\s*,\s*(?P<time_s>[^,]*?)\s*\)$")


class ThrusterEvent(Strict):
    """A failure or recovery of one thruster; also given as the exemplar writes it: "(1,failure,35)"."""

    thruster: Annotated[int, Field(ge=1, le=6, strict=True)]
    event: Literal["failure", "recovery"]
    time_s: Distribution

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        match = _EVENT_TEXT.match(value.strip())
        if match is None:
            raise ValueError(f"{value!r} is not of the form (thruster,failure|recovery,time in s)")
        parts: dict[str, Any] = match.groupdict()
        for key, convert in (("thruster", int), ("time_s", float)):
            try:
                parts[key] = convert(parts[key])
            except ValueError:
                raise ValueError(f"{parts[key]!r} in {value!r} is no number") from None
        return parts


class Battery(Strict):
    """Battery of revision 1.5: falls linearly from 1.0, recharged at once near the station."""

    discharge_time_s: Positive = 200.0
    publishing_period_s: Positive = 1.0
    station_x_m: float = -3.0
    station_y_m: float = -2.0
    station_radius_m: Positive = 0.5
    """Half-width of the box in x and y within which the vehicle counts as docked."""


class Latencies(Strict):
    """Times that software takes, each drawn anew at every occurrence."""

    task_start_s: Distribution = 0.0
    """From guided mode to the request of the first task."""
    mode_change_s: Distribution = 0.0
    """From the mode manager's answer to the mode's effect."""
    inference_s: Distribution = 1.0
    """Mission time of one analyze and plan (stock Pellet starts a Java machine for each)."""

    @field_validator("*", mode="after")
    @classmethod
    def _no_time_travel(cls, value: Any) -> Any:
        return _not_negative(value)


class Calibration(Strict):
    """Parameters of vehicle, autopilot and simulator that the facts leave open; they act on every manager alike."""

    position_gain_per_s: Positive = 0.48
    horizontal_speed_limit_m_per_s: Positive = 0.34
    vertical_speed_limit_m_per_s: Positive = 0.36
    velocity_time_constant_s: Annotated[float, Field(ge=0.15)] = 0.5
    altitude_error_m: Distribution = 0.0
    """Steady error of the autopilot's altitude: it holds its set-point plus this."""
    drift_x_m: Distribution = 0.0
    drift_y_m: Distribution = 0.0
    """Way from the spawning place to the origin of the local frame (where guided mode begins)."""
    real_time_factor_loss: Distribution = 0.0
    """The simulated world runs 1 / (1 + loss) as fast as the software's clock."""

    @field_validator("real_time_factor_loss", mode="after")
    @classmethod
    def _never_faster(cls, value: Any) -> Any:
        return _not_negative(value)


class RandomSettings(Strict):
    """The random manager."""

    adaptation_period_s: Positive = 15.0


class MetacontrolSettings(Strict):
    """The metacontrol manager."""

    reasoning_period_s: Positive = 2.0


class BehaviourTreeSettings(Strict):
    """The behaviour tree manager of revision 1.5."""

    tick_period_s: Positive = 0.1
    visibility_thresholds_m: tuple[float, ...] = (3.25, 2.25, 1.25)
    search_modes: tuple[str, ...] = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low")
    battery_limit: float = 0.25

    @model_validator(mode="after")
    def _paired(self) -> Self:
        if len(self.visibility_thresholds_m) != len(self.search_modes):
            raise ValueError("visibility_thresholds_m and search_modes must have the same length")
        return self


class ManagerSettings(Strict):
    """Settings of managing subsystems by name; an outside manager finds its own under its own name."""

    model_config = ConfigDict(extra="allow", frozen=True)

    random: RandomSettings = RandomSettings()
    metacontrol: MetacontrolSettings = MetacontrolSettings()
    bt: BehaviourTreeSettings = BehaviourTreeSettings()


class ReactionMetric(Strict):
    """What revision 1.5 calls a reaction (its metrics node)."""

    visibility_thresholds_m: tuple[float, ...] = (3.25, 2.25, 1.25)
    expected_altitudes_m: tuple[float, ...] = (3.0, 2.0, 1.0)
    battery_limit: float = 0.25

    @model_validator(mode="after")
    def _paired(self) -> Self:
        if len(self.visibility_thresholds_m) != len(self.expected_altitudes_m):
            raise ValueError("visibility_thresholds_m and expected_altitudes_m must have the same length")
        if list(self.visibility_thresholds_m) != sorted(self.visibility_thresholds_m, reverse=True):
            raise ValueError("visibility_thresholds_m must fall")
        return self


class Knowledge(Strict):
    """The knowledge base: ontology files, and values that replace those in them."""

    ontologies: Annotated[tuple[str, ...], Field(min_length=1)] = ("suave.owl",)
    values: dict[str, float] = {}
    """New hasValue of a named QAvalue individual, such as qa_water_visibility_low: 0.5."""
    reasoner: str = "pellet"


class Scenario(Strict):
    """One mission's world, vehicle, software and knowledge."""

    name: Name
    description: str = ""
    revision: Revision
    mission: Mission = Mission()
    start: Start = Start()
    pipeline: Pipeline = Pipeline()
    current: Current = Current()
    signals: dict[Name, Signal]
    thruster_events: tuple[ThrusterEvent, ...] = ()
    battery: Battery | None = None
    latencies: Latencies = Latencies()
    calibration: Calibration = Calibration()
    modes_file: str = "suave_modes.yaml"
    default_modes: dict[Name, str] = {
        "f_generate_search_path": "fd_spiral_low",
        "f_follow_pipeline": "fd_follow_pipeline",
    }
    knowledge: Knowledge = Knowledge()
    managers: ManagerSettings = ManagerSettings()
    reaction_metric: ReactionMetric = ReactionMetric()

    @field_validator("signals", mode="after")
    @classmethod
    def _visibility_is_there(cls, value: dict[str, Any]) -> dict[str, Any]:
        if "water_visibility" not in value:
            raise ValueError("the detection of the pipeline needs a signal named water_visibility")
        return value
