"""Failures and recoveries of the vehicle's thrusters: those of the scenario, and those by maintain_motion."""

from collections.abc import Callable
from dataclasses import dataclass, field

from suave_des.chance import Chance
from suave_des.domain import thruster_name
from suave_des.managed.node import Log
from suave_des.monitor.monitors import ScheduledEvent
from suave_des.scenario.models import Scenario
from suave_des.vehicle.vehicle import Vehicle


def schedule(scenario: Scenario, chance: Chance) -> list[ScheduledEvent]:
    """List the thruster events of a run, with the times that are drawn for it."""
    times_s = [
        chance.draw(f"thruster_events.{number}.time_s", event.time_s, least=0.0)
        for number, event in enumerate(scenario.thruster_events)
    ]
    return [
        ScheduledEvent(event.thruster, event.event == "failure", time_s, event.recoverable)
        for event, time_s in zip(scenario.thruster_events, times_s, strict=True)
    ]


@dataclass(eq=False)
class ThrusterFaults:
    """Applies thruster events to the vehicle of a mission.

    Attributes:
        scenario: says whether the first failure may have no effect.
        chance: of the run.
        vehicle: the vehicle whose thrusters fail and recover.
        log: adds an event to the mission's record.
        listeners: each is called after a change of a thruster's health.
        unrecoverable: thrusters that maintain_motion cannot currently recover.
    """

    scenario: Scenario
    chance: Chance
    vehicle: Vehicle
    log: Log
    listeners: list[Callable[[], None]] = field(default_factory=list, init=False)
    unrecoverable: set[int] = field(default_factory=set, init=False)
    _had_failure: bool = field(default=False, init=False)

    def apply(self, t_s: float, event: ScheduledEvent) -> None:
        """Apply one of the scenario's events at mission time t."""
        is_first_failure = event.fails and not self._had_failure
        self._had_failure |= event.fails
        if is_first_failure and self._has_no_effect(t_s):
            self.log("thruster_monitor", "failure_without_effect", thruster_name(event.thruster))
            return
        if event.fails and not event.recoverable:
            self.unrecoverable.add(event.thruster)
        else:
            self.unrecoverable.discard(event.thruster)
        self.set_health(t_s, event.thruster, 0.0 if event.fails else 1.0)

    def set_health(self, t_s: float, thruster: int, health: float) -> None:
        """Set a thruster's health."""
        self.vehicle.set_thruster_health(t_s, thruster, health)
        for listener in self.listeners:
            listener()

    def _has_no_effect(self, t_s: float) -> bool:
        """Decide whether the mission's first failure, at mission time t, has no effect on the vehicle."""
        failures = self.scenario.revision.thruster_failures
        if t_s < failures.effective_from_s:
            return True
        probability = failures.loss_probability
        return probability > 0.0 and self.chance.stream("thruster_failures").random() < probability
