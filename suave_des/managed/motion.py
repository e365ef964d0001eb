"""Maintain motion: inactive in normal operation; activating it recovers the thrusters (facts: kas-lab/suave)."""

from __future__ import annotations

from collections.abc import Callable

import simpy

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
        self._recovered = 0
        self._pause: simpy.Event | None = None  # of the recovery that goes on

    def activated(self) -> None:
        """Begin a recovery, unless an earlier one still goes on."""
        if self._pause is None:
            self._recovered = 0
            self._wait(RECOVERY_TIME_S)

    def deactivated(self) -> None:
        """Back to normal operation; revision 1.5 breaks a recovery off."""
        if not self._revision.survives_deactivation:
            self._pause = None

    def _wait(self, time_s: float) -> None:
        self._pause = pause = simpy.Timeout(self.env, time_s)
        pause.callbacks.append(self._go_on)

    def _go_on(self, pause: simpy.Event) -> None:
        if pause is not self._pause:
            return  # broken off
        if self._recovered == THRUSTERS:
            self._pause = None
            return
        self._recovered = thruster = self._recovered + 1
        self._restore(thruster)
        self._bus.publish(Diagnostic(self.env.now, Kind.COMPONENT_STATUS, thruster_name(thruster), RECOVERED))
        self._wait(THRUSTER_PERIOD_S)
