"""Maintain motion: inactive in normal operation; activating it recovers the thrusters.

Source: node f_maintain_motion of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process
from suave_des.domain import THRUSTER_NAMES
from suave_des.managed.node import FunctionNode
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.thrusters import Thrusters
from suave_des.scenario.revision import RecoveryRevision


@dataclass(eq=False)
class MaintainMotion(FunctionNode):
    """The motion function: recovers the thrusters one by one after a delay, and reports each that can be recovered.

    Attributes:
        delay_s: draws the time from the activation to the recovery of the first thruster.
    """

    bus: DiagnosticsBus
    revision: RecoveryRevision
    thrusters: Thrusters
    delay_s: Callable[[], float]
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
            for number, name in enumerate(THRUSTER_NAMES, start=1):
                if self.thrusters.recover(number):
                    self.bus.publish(Diagnostic(self.env.now, Kind.COMPONENT_STATUS, name, RECOVERED))
                yield self.env.timeout(self.revision.thruster_period_s)
            self._recovery = None
        except simpy.Interrupt:
            return
