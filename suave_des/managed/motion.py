"""Maintain motion: inactive in normal operation; activating it recovers the thrusters (facts: kas-lab/suave)."""

from __future__ import annotations

from collections.abc import Callable

import simpy

from suave_des.clock import Process
from suave_des.managed.node import FunctionNode
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.monitors import thruster_name
from suave_des.scenario.revision import RecoveryRevision

RECOVERY_TIME_S = 10.0
THRUSTER_PERIOD_S = 0.25
THRUSTERS = 6


class MaintainMotion(FunctionNode):
    """The motion function: after 10 s restores thruster by thruster, and says so on the diagnostics bus.

    Args:
        env: the mission's clock.
        bus: where to publish.
        revision: how the exemplar's revision behaves.
        restore: called with the number of each thruster to restore.
    """

    def __init__(
        self,
        env: simpy.Environment,
        bus: DiagnosticsBus,
        revision: RecoveryRevision,
        restore: Callable[[int], None],
    ) -> None:
        super().__init__(env)
        self._bus = bus
        self._revision = revision
        self._restore = restore
        self._process: simpy.Process | None = None

    def activated(self) -> None:
        """Begin a recovery, unless an earlier one still goes on."""
        if self._process is None or not self._process.is_alive:
            self._process = self.env.process(self._recover())

    def deactivated(self) -> None:
        """Back to normal operation; revision 1.5 breaks a recovery off."""
        if self._process is not None and self._process.is_alive and not self._revision.survives_deactivation:
            self._process.interrupt()
            self._process = None

    def _recover(self) -> Process:
        try:
            yield self.env.timeout(RECOVERY_TIME_S)
            for thruster in range(1, THRUSTERS + 1):
                self._restore(thruster)
                self._bus.publish(Diagnostic(self.env.now, Kind.COMPONENT_STATUS, thruster_name(thruster), RECOVERED))
                yield self.env.timeout(THRUSTER_PERIOD_S)
        except simpy.Interrupt:
            return
