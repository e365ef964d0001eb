"""The mode manager: takes requests for modes and lets them take effect after a latency."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial

import simpy

from suave_des.clock import call_at
from suave_des.domain import UNGROUND_MODE
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.events import Log, ModeRefused, ModeRequested, ModeSet
from suave_des.managed.node import FunctionNode
from suave_des.scenario.modes import Mode, ModeTable


@dataclass(eq=False)
class ModeManager:
    """Offers change_mode and available_modes for the functions of a modes file.

    A request is answered at once: True for any known mode, unless its function refuses it, and for
    the one that is already set, in which case nothing happens. The effect comes later; effects on
    one function keep the order of their requests.

    Attributes:
        latency_s: draws the time from a request to its effect.
        listeners: each is called with function and mode when a mode has taken effect.
        adaptation_listeners: each is called at each adaptation with function, mode before and mode
            requested.
        adaptations: changes from one mode to another of functions in use; neither a task's first
            mode of a function nor the fd_unground at its end counts.
        requests: requests for a mode that differs from the previous one.
        unknown_requests: functions and modes that were requested and do not exist.
        refusals: requests that were refused by their function.
    """

    env: simpy.Environment
    table: ModeTable
    nodes: Mapping[str, FunctionNode]
    latency_s: Callable[[], float]
    log: Log
    listeners: list[Callable[[str, Mode], None]] = field(default_factory=list)
    adaptation_listeners: list[Callable[[str, str, str], None]] = field(default_factory=list)
    adaptations: int = 0
    requests: int = 0
    unknown_requests: dict[tuple[str, str], None] = field(default_factory=dict)
    refusals: int = 0
    _requested: dict[str, str] = field(default_factory=dict)
    _effect_due_s: dict[str, float] = field(default_factory=dict)
    _in_use: set[str] = field(default_factory=set)

    def available_modes(self, function: str) -> tuple[str, ...]:
        """List a function's modes, in the order of the modes file; none for one that is unknown or
        has no node.
        """
        return (
            self.table.modes(function) if function in self.table and function in self.nodes else ()
        )

    def current_mode(self, function: str) -> str | None:
        """Return the last requested mode; None before the first request."""
        return self._requested.get(function)

    def may_be_active(self, function: str) -> bool:
        """Whether a function is active, or a mode of it has still to take effect."""
        is_pending = self._effect_due_s.get(function, -math.inf) >= self.env.now
        return self.nodes[function].active or is_pending

    def end_task(self, functions: Iterable[str]) -> None:
        """End the functions' task: mode changes do not count as adaptations until they are in use
        again.
        """
        self._in_use.difference_update(functions)

    def change_mode(self, function: str, mode: str, latency_s: float | None = None) -> bool:
        """Request a mode; False for a function or mode that the modes file does not have, or that
        has no node here, and for a mode that the function does not accept now.

        Its effect comes after `latency_s`; None: after a latency that is drawn.
        """
        if self._requested.get(function) == mode:
            return True
        chosen = self.table.get(function, mode)
        if chosen is None or function not in self.nodes:
            self.unknown_requests[function, mode] = None
            self.log("mode_manager", ModeRefused(function, mode))
            return False
        if not self.nodes[function].accepts(chosen):
            self.refusals += 1
            self.log("mode_manager", ModeRefused(function, mode))
            return False
        before, self._requested[function] = self._requested.get(function, ""), mode
        self.requests += 1
        if function in self._in_use:
            self.adaptations += 1
            for listener in self.adaptation_listeners:
                listener(function, before, mode)
        elif mode != UNGROUND_MODE:
            self._in_use.add(function)
        self.log("mode_manager", ModeRequested(function, mode))
        delay_s = self.latency_s() if latency_s is None else latency_s
        due_s = max(self.env.now + delay_s, self._effect_due_s.get(function, 0.0))
        self._effect_due_s[function] = due_s
        call_at(self.env, due_s, partial(self._take_effect, function, chosen))
        return True

    def refusal(self, function: str, mode: str) -> InputError:
        """Say what is wrong with a request that is refused, and what would be right."""
        if function not in self.table and mode in self.table:
            called = f"change_mode({shown(function)}, {shown(mode)})"
            return InputError(f"{called} has its arguments swapped", remedy="function, then mode")
        if known := self.available_modes(function):
            return InputError(
                f"{function} has no mode {shown(mode)}", remedy=did_you_mean(mode, known)
            )
        remedy = (
            f"{did_you_mean(function, self.nodes)}; name its class under functions: in the scenario"
        )
        return InputError(f"there is no function {shown(function)}", remedy=remedy)

    def _take_effect(self, function: str, mode: Mode) -> None:
        self.nodes[function].apply(mode)
        self.log("mode_manager", ModeSet(function, mode.name))
        for listener in self.listeners:
            listener(function, mode)
