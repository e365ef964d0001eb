"""Differences between the exemplar's revisions, as data; the values, with their sources, are in scenarios/revisions."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from suave_des.scenario.quantities import (
    FARTHEST_M,
    DelayDistribution,
    Distribution,
    Length,
    Name,
    NotNegative,
    OffsetDistribution,
    Period,
    Real,
    Strict,
    Within,
    support,
    wrong,
)

Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]


class CoordinatorRevision(Strict):
    """The mission node: how it polls, and what it records."""

    poll_period_s: Period
    """Period of its loop."""
    limit_check_period_s: Annotated[Real, Field(ge=0.001, le=1000)]
    """Period at which the time limit is checked."""
    search_time: Literal["poll", "detection"]
    """Time of the poll that saw the detection, or of the detection itself; truncated to whole seconds."""
    maintain_motion_per_task: bool
    """Whether maintain_motion is cancelled with each task and requested again with the next."""


class SpiralRevision(Strict):
    """The search function's spiral and its altitude work-around."""

    centre: Literal["origin", "activation", "first_activation"]
    """Centre: the local frame's origin, the position at each activation, or at the first."""
    restarts_on_activation: bool
    """Whether each activation restarts the spiral."""
    resends_on_activation: bool = False
    """Whether a spiral that continues sends its way-point at once, not after ticks_before_resending only."""
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
    """What a failed thruster does, unless its event says so: `frozen` keeps its last thrust, `dead` gives none."""
    effective_from_s: NotNegative = 0.0
    """Before this mission time, failures have no effect."""


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
    """Whether reasoning waits for the first measurement of each attribute of which a design expects a value."""
    always_improve: tuple[Name, ...]
    """Functions whose objectives have o_always_improve (1.5); see improve_when_exceeded."""
    improve_when_exceeded: bool
    """Whether an objective is also adapted when a measured value exceeds what its current design expects."""
    ignores_diagnostics_without_objective: bool
    """Whether diagnostics are ignored while there is no objective."""


Timer = Literal["monitors", "metacontrol"]
"""Periodic timers of nodes."""


class Revision(Strict):
    """One revision of the exemplar's software."""

    name: str
    """Name in result files."""
    timers_in_step: tuple[Timer, ...]
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
    """By attribute to which the ontology gives none: when a measured value is worse than an expected one."""
    metacontrol: MetacontrolRevision
    """The metacontrol manager."""
