"""What the functions that move the vehicle share: they foresee their ticks, and rest until one that matters."""

from __future__ import annotations

import simpy

from suave_des.clock import call_at, call_next
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.vehicle.vehicle import Vehicle, Watch

FEWEST_AHEAD = 6
MOST_AHEAD = 24
"""Set-points that are given ahead at a time: few after a change of control, as what was given is lost at the next one;
twice as many each time that none has come.
"""


class TravellingNode(FunctionNode):
    """A node that looks at each tick of its timer whether a place is reached, and then sends the next one.

    Instead of stopping at each tick, it gives set-points ahead and rests; should the vehicle's control change
    meanwhile, it catches up with what has happened until then and foresees the rest anew.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
    """

    def __init__(self, env: simpy.Environment, vehicle: Vehicle, sender: SetPointSender) -> None:
        super().__init__(env)
        self._vehicle = vehicle
        self._sender = sender
        self._watch: Watch | None = None
        self._alarm: simpy.Event | None = None
        """The event that the node waits for; one that is not this any more comes too late."""
        self._rests = False
        self._ahead = FEWEST_AHEAD
        vehicle.control_listeners.append(self._control_changed)

    def wake(self) -> None:
        """The tick has come until which the node was to rest."""

    def foresee_anew(self) -> None:
        """The vehicle's control has changed before that tick."""

    def _rest_until(self, t_s: float) -> None:
        self._alarm = call_at(self.env, t_s, self._end_rest)
        self._rests = True

    def _end_rest(self, event: simpy.Event) -> None:
        if event is self._alarm:
            self._rests = False
            self._ahead = min(2 * self._ahead, MOST_AHEAD)
            self.wake()

    def _control_changed(self, row: int) -> None:
        if self._rests and self._watch is not None:
            self._rests = False
            # Whatever else changes control in this event is to have done so when the rest is foreseen anew.
            self._alarm = call_next(self.env, self._after_change)

    def _after_change(self, event: simpy.Event) -> None:
        if event is self._alarm:
            self._ahead = FEWEST_AHEAD
            self.foresee_anew()

    def _stop(self, tick: int) -> None:
        """Rest for good, and drop what was given ahead for ticks after the given one."""
        watch, self._watch = self._watch, None
        self._alarm, self._rests = None, False
        if watch is not None:
            self._vehicle.drop_ahead(self.env.now, watch, tick)
