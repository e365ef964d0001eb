"""The mode manager: takes requests for modes and lets them take effect after a latency."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import simpy

from suave_des.clock import call_at
from suave_des.managed.node import FunctionNode, Log
from suave_des.scenario.modes import UNGROUND_MODE, Mode, ModeTable

Listener = Callable[[str, Mode], None]


class ModeManager:
    """Offers change_mode and available_modes for the functions of a modes file.

    A request is answered at once: True for any known mode, even the one that is already set, in which case nothing
    happens. The effect comes later; effects on one function keep the order of their requests.

    Attributes:
        adaptations: changes from one mode to another of functions in use; neither a task's first mode of a function nor
            the fd_unground at its end counts.

    Args:
        env: the mission's clock.
        table: the modes.
        nodes: the function's nodes, by function name.
        latency_s: draws the time from a request to its effect.
        log: takes what happened.
    """

    def __init__(
        self,
        env: simpy.Environment,
        table: ModeTable,
        nodes: Mapping[str, FunctionNode],
        latency_s: Callable[[], float],
        log: Log,
    ) -> None:
        self._env = env
        self._table = table
        self._nodes = nodes
        self._latency_s = latency_s
        self._log = log
        self._requested: dict[str, str] = {}
        self._effect_due_s: dict[str, float] = {}
        self._listeners: list[Listener] = []
        self._in_use: set[str] = set()
        self.adaptations = 0

    def available_modes(self, function: str) -> tuple[str, ...]:
        """All modes of a function, in the order of the modes file; none for an unknown function."""
        return self._table.modes(function) if function in self._table.table else ()

    def current_mode(self, function: str) -> str | None:
        """The mode that was requested last; none before the first request."""
        return self._requested.get(function)

    def on_effect(self, listener: Listener) -> None:
        """Have `listener` called with function and mode when a mode has taken effect."""
        self._listeners.append(listener)

    def task_over(self, functions: Iterable[str]) -> None:
        """The functions' task is over: what comes now is no adaptation, until they are given a mode again."""
        self._in_use.difference_update(functions)

    def change_mode(self, function: str, mode: str) -> bool:
        """Request a mode; False for a function or mode that the modes file does not have, or that has no node here."""
        if self._requested.get(function) == mode:
            return True
        chosen = self._table.table.get(function, {}).get(mode)
        if chosen is None or function not in self._nodes:
            self._log("mode_manager", "refused", f"{function}: no mode {mode}")
            return False
        self._requested[function] = mode
        if function in self._in_use:
            self.adaptations += 1
        elif mode != UNGROUND_MODE:
            self._in_use.add(function)
        self._log("mode_manager", "mode_requested", f"{function} -> {mode}")
        due_s = max(self._env.now + self._latency_s(), self._effect_due_s.get(function, 0.0))
        self._effect_due_s[function] = due_s
        call_at(self._env, due_s, lambda _: self._take_effect(function, chosen))
        return True

    def _take_effect(self, function: str, mode: Mode) -> None:
        self._nodes[function].apply(mode)
        self._log("mode_manager", "mode_set", f"{function} = {mode.name}")
        for listener in self._listeners:
            listener(function, mode)
