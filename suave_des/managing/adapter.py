"""The adapter between the managing and the managed subsystem: tasks become objectives, plans become mode changes."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from suave_des.clock import Alarm, tick_at_or_after
from suave_des.domain import Task
from suave_des.knowledge.state import NO_GROUNDING, Decision, Plan
from suave_des.managing.base import ManagedSystem


@dataclass(frozen=True)
class TaskBridge:
    """Passes the mission's tasks on as functions that need an objective (the exemplar's task bridge).

    Attributes:
        period_s: tasks are passed on at ticks of this period; 0: at once.
        phase_s: mission time of a tick.
    """

    system: ManagedSystem
    period_s: float
    phase_s: float

    def pass_on(self, task: Task, update: Callable[[tuple[str, ...]], None]) -> None:
        """Call `update` with the task's functions at the bridge's next tick."""

        def deliver() -> None:
            update(task.functions)
            self.system.state_changed()

        env = self.system.env
        if self.period_s > 0.0:
            Alarm(env, deliver).set(tick_at_or_after(env.now, self.phase_s, self.period_s))
        else:
            Alarm(env, deliver).set_now()


class Adapter:
    """Maps plans to mode changes: a function design is carried out by the mode of its name."""

    def __init__(self, system: ManagedSystem) -> None:
        self._system = system
        self._without_design: frozenset[str] = frozenset()  # functions for which the last plan had no design

    def is_in_force(self, plan: Plan) -> bool:
        """Return whether carrying a plan out would neither change a mode nor record anything."""
        current_mode = self._system.modes.current_mode
        for decision in plan.decisions:
            if decision.design is not None and current_mode(decision.function) != decision.design:
                return False
        return plan.without_design == self._without_design

    def carry_out(self, plan: Plan, groundings: dict[str, str], functions: Collection[str]) -> dict[str, str]:
        """Request the modes of a plan.

        Args:
            plan: the decisions.
            groundings: the function designs in use, by function.
            functions: those that still have an objective; decisions on others are dropped.

        Returns:
            The function designs that are in use from now on, by function.
        """
        grounded = {}
        for decision in plan.decisions:
            function, design = decision.function, decision.design
            if function not in functions:
                continue
            if design is None:
                if function not in self._without_design:
                    self._log("no_design_left", function, decision)
            elif self._system.change_mode(function, design):
                grounded[function] = design
                before = groundings.get(function, NO_GROUNDING)
                if before != design:
                    self._log("adaptation", f"{function}: {before} -> {design}", decision)
        self._without_design = plan.without_design
        return grounded

    def _log(self, event: str, what: str, decision: Decision) -> None:
        if self._system.recorded:
            left_out = "".join([f"; not {each.design}: {each.reason}" for each in decision.rejected])
            self._system.log(event, f"{what}: {decision.reason}{left_out}")
