"""What the functions that move the vehicle share: they foresee their ticks, and sleep until one that matters."""

from __future__ import annotations

from collections.abc import Generator

import simpy

from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.vehicle.vehicle import Vehicle, Watch

_CONTROL_CHANGE = "control change"


class TravellingNode(FunctionNode):
    """A node that looks at each tick of its timer whether a place is reached, and then sends the next one.

    Instead of stopping at each tick, it gives set-points ahead; should the vehicle's control change meanwhile, it
    catches up with what has happened until then and foresees the rest anew.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
    """

    def __init__(self, env: simpy.Environment, vehicle: Vehicle, sender: SetPointSender) -> None:
        super().__init__(env)
        self._vehicle = vehicle
        self._sender = sender
        self._process: simpy.Process | None = None
        self._asleep = False
        vehicle.control_listeners.append(self._control_changed)

    def _sleep(self, watch: Watch, tick: int) -> Generator[simpy.Event, None, bool]:
        """Sleep until a tick; False if a change of the vehicle's control has come first."""
        delay_s = watch.time_s(tick) - self.env.now
        self._asleep = True
        try:
            yield simpy.Timeout(self.env, delay_s if delay_s > 0.0 else 0.0)
        except simpy.Interrupt as interrupt:
            if interrupt.cause is not _CONTROL_CHANGE or self.env.active_process is not self._process:
                raise
            return False
        finally:
            self._asleep = False
        return True

    def _control_changed(self, row: int) -> None:
        if self._asleep and self._process is not None:
            self._asleep = False  # one waking is enough
            self._process.interrupt(_CONTROL_CHANGE)

    def _stop(self, watch: Watch | None, tick: int) -> None:
        """End the process, and what it has given ahead for ticks after the given one."""
        process, self._process = self._process, None
        self._asleep = False
        if process is not None and process.is_alive:
            process.interrupt()
            if watch is not None:
                self._vehicle.drop_ahead(self.env.now, watch, tick)
