"""Maintain motion: inactive in normal operation; activating it recovers the thrusters.

Source: node f_maintain_motion of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from suave_des.clock import Process
from suave_des.domain import THRUSTER_NAMES
from suave_des.managed.node import ProcessNode
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.thrusters import Thrusters
from suave_des.scenario.models import RecoveryRevision


@dataclass(eq=False)
class MaintainMotion(ProcessNode):
    """The motion function: recovers the thrusters one by one after a delay, and reports each as
    recovered that can be, healthy ones too.

    Attributes:
        delay_s: draws the time from the activation to the recovery of the first thruster.
    """

    bus: DiagnosticsBus
    revision: RecoveryRevision
    thrusters: Thrusters
    delay_s: Callable[[], float]

    def activated(self) -> None:
        """Begin a recovery, unless an earlier one is still in progress."""
        if self._process is None or not self._process.is_alive:
            super().activated()

    def deactivated(self) -> None:
        """Return to normal operation; revision 1.5 aborts a recovery."""
        if not self.revision.survives_deactivation:
            super().deactivated()
            self._process = None

    def activity(self) -> Process:
        """Recover the thrusters."""
        yield self.env.timeout(self.delay_s())
        for number, name in enumerate(THRUSTER_NAMES, start=1):
            if self.thrusters.recover(number):
                self.bus.publish(Diagnostic(self.env.now, Kind.COMPONENT_STATUS, name, RECOVERED))
            yield self.env.timeout(self.revision.thruster_period_s)
