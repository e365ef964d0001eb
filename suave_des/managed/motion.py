"""Maintain motion: inactive in normal operation; activating it recovers the thrusters (facts: kas-lab/suave)."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process
from suave_des.domain import THRUSTERS, thruster_name
from suave_des.managed.node import FunctionNode
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.scenario.revision import RecoveryRevision


@dataclass(eq=False)
class MaintainMotion(FunctionNode):
    """The motion function: recovers the thrusters one by one after a delay, and reports each on the diagnostics bus.

    Attributes:
        delay_s: draws the time from the activation to the recovery of the first thruster.
        unrecoverable: thrusters that cannot be recovered; they are skipped, and not reported.
    """

    bus: DiagnosticsBus
    revision: RecoveryRevision
    set_health: Callable[[float, int, float], None]
    delay_s: Callable[[], float]
    unrecoverable: Collection[int] = ()
    _recovery: simpy.Process | None = field(default=None, init=False)

    def activated(self) -> None:
        """Begin a recovery, unless an earlier one is still in progress."""
        if self._recovery is None:
            self._recovery = self.env.process(self._recover())

    def deactivated(self) -> None:
        """Return to normal operation; revision 1.5 aborts a recovery."""
        if self._recovery is not None and not self.revision.survives_deactivation:
            self._recovery.interrupt()
            self._recovery = None

    def _recover(self) -> Process:
        try:
            yield self.env.timeout(self.delay_s())
            for thruster in range(1, THRUSTERS + 1):
                if thruster not in self.unrecoverable:
                    self.set_health(self.env.now, thruster, 1.0)
                    name = thruster_name(thruster)
                    self.bus.publish(Diagnostic(self.env.now, Kind.COMPONENT_STATUS, name, RECOVERED))
                yield self.env.timeout(self.revision.thruster_period_s)
            self._recovery = None
        except simpy.Interrupt:
            return
