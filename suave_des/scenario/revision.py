"""What differs between the exemplar's revisions, as data (values with their sources: scenarios/revisions/*.yaml)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from suave_des.scenario.distributions import Distribution, Strict

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Probability = Annotated[float, Field(ge=0, lt=1)]


class CoordinatorRevision(Strict):
    """The mission node: how it polls, and what it writes down."""

    poll_period_s: Positive
    limit_check_period_s: Positive
    search_time: Literal["poll", "detection"]
    """"poll": the coordinator's poll that saw the detection, cut to whole seconds; "detection": its own time, cut."""
    search_time_when_not_found: Literal["limit", "duration"]
    maintain_motion_per_task: bool
    """Whether maintain_motion is cancelled with each task and requested anew with the next."""


class SpiralRevision(Strict):
    """The search function's spiral and its altitude work-around."""

    centre: Literal["origin", "activation"]
    """Where the spiral is centred: the local frame's origin, or the position at each activation."""
    restarts_on_activation: bool
    workaround_step_m: Positive
    workaround_cleared_on_activation: bool


class FollowRevision(Strict):
    """The follow function's path."""

    acceptance_m: Positive
    poll_period_s: Positive
    restarts_on_activation: bool
    """Whether the path starts again from its first point (else it goes on with the points not yet reached)."""
    adds_remaining_way: bool
    """Whether a deactivation adds the way from the last point to the present position to the distance."""


class RecoveryRevision(Strict):
    """Thruster recovery in maintain_motion."""

    survives_deactivation: bool


class MonitorsRevision(Strict):
    """Monitors and detection mock-up."""

    thruster_event_times: Literal["after_previous", "after_start"]
    visibility_publishing_period_s: Positive
    detected_point_height_m: NotNegative
    """Height above the pipeline's points at which the detection mock-up looks for them."""


class SetPointRevision(Strict):
    """How functions hand set-points to the autopilot."""

    loss_probability: Probability
    """A publisher made for each call may publish before the autopilot has discovered it."""
    node_frame_offset_x_m: Distribution
    node_frame_offset_y_m: Distribution
    node_frame_offset_z_m: Distribution
    """Steady error of one node's frame against the simulator's, measured once per node and run."""


class RandomRevision(Strict):
    """The random manager."""

    on_task_request: bool
    starts_at_launch: bool
    """Whether its timer runs since launch, so that its phase at t = 0 is arbitrary; else it starts with the task."""


class MetacontrolRevision(Strict):
    """The metacontrol manager and its task bridge."""

    task_bridge_period_s: NotNegative
    """Tasks reach the reasoner at ticks of this period; 0: at once."""
    objectives_at_launch: bool
    """Whether the first task's objectives exist from launch on."""
    waits_for_first_measurement: bool
    search_always_improves: bool
    """Whether search objectives carry o_always_improve (rev 1.5); see search_improves_when_exceeded."""
    search_improves_when_exceeded: bool
    """Whether an objective is also adapted when a measured value exceeds what its present design expects."""
    ignores_diagnostics_without_objective: bool


class Revision(Strict):
    """One revision of the exemplar's software."""

    name: str
    coordinator: CoordinatorRevision
    spiral: SpiralRevision
    follow: FollowRevision
    recovery: RecoveryRevision
    monitors: MonitorsRevision
    set_points: SetPointRevision
    random: RandomRevision
    metacontrol: MetacontrolRevision
