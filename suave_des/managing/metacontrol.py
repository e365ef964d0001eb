"""Metacontrol: a MAPE-K loop over an OWL knowledge base (paper, section on Metacontrol).

Monitor: read the measured values; component statuses arrive as diagnostics. Analyze: a reasoner
infers what the rules say about that state, which takes a while. Plan: the best function design for
each objective that needs one, by the values that are measured by then. Execute: request the mode of
the design's name. Source of what revisions do differently: kas-lab/suave with its reasoner,
4 February 2023 to 1.5.0.
"""

from collections.abc import Callable, Collection, Hashable
from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar, Final, Protocol
from weakref import WeakKeyDictionary

from suave_des.clock import call_at, call_next, tick_at_or_after
from suave_des.domain import UNGROUND_MODE, Task
from suave_des.knowledge.state import (
    NO_GROUNDING,
    UNGROUNDED,
    Decision,
    Inference,
    KnowledgeState,
    ObjectiveState,
    Plan,
    Reasoning,
    exact,
)
from suave_des.managing.base import AdaptationProcess, Dependencies, ManagingSubsystem, System
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, Kind
from suave_des.scenario.models import AnyDistribution, MetacontrolRevision, draw, support


class Decider(Protocol):
    """What the loop asks for decisions: the knowledge base's reasoner, or a decision table."""

    def analyze(self, state: KnowledgeState) -> Inference:
        """Infer what follows in a state."""

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Choose function designs."""

    @property
    def thresholds(self) -> tuple[float, ...] | None:
        """The numbers with which measured values are compared; None: it may do more than that."""

    def distinguished(self, measured: Collection[float]) -> Hashable:
        """What can be distinguished in measured values."""

    @property
    def expected_attributes(self) -> frozenset[str]:
        """The quality attributes to wait for."""


@dataclass(frozen=True)
class LoopSettings:
    """What the loop works with.

    Attributes:
        revision: how tasks and diagnostics reach it.
        period_s: None: cycles begin with events.
        latency_s: time from the beginning of a cycle to its requests.
        forgets_recovered: whether a component that has recovered counts as one that never failed
            once a plan is executed.
    """

    decider: Decider
    revision: MetacontrolRevision
    period_s: float | None
    latency_s: AnyDistribution
    forgets_recovered: bool = True


_MeasuredKey = tuple[tuple[str, ...], Hashable]
"""The measured quality attributes, and what can be distinguished in their values: the regions, or
the values.
"""
_cached: WeakKeyDictionary[Decider, dict[MetacontrolRevision, dict[Hashable, Reasoning]]] = (
    WeakKeyDictionary()
)
"""What follows and is planned, by symbolic state: missions of one scenario go through the same few
states.
"""
_MAX_CACHED: Final = 4096


class Metacontrol(ManagingSubsystem):
    """The metacontrol manager.

    What the reasoner infers is never written back, so nothing has to be retracted: the state below
    changes only by tasks, diagnostics, measurements and executed plans.

    Attributes:
        objectives: the status of the objective of each required function; None while the objective
            is met.
        groundings: the function designs in use, by function.
        components: the reported statuses, by component.
        measurements: the last measured values, by quality attribute.

    Example:
        >>> class Cautious(Metacontrol):
        ...     def measured(self, attribute):
        ...         value = super().measured(attribute)
        ...         return value if value is None else 0.9 * value
    """

    needs_knowledge: ClassVar[bool] = True
    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: System) -> None:
        super().__init__(system)
        scenario, settings = system.scenario, self.loop_settings()
        self._settings = settings
        self._revision = revision = settings.revision
        self._reasoner = settings.decider
        # In a derived class analyze and plan may depend on more than the state, so their results
        # are not cached.
        methods = type(self).analyze, type(self).plan
        self._is_cacheable = methods == (Metacontrol.analyze, Metacontrol.plan)
        # What another analyze makes of the measured values is not known here.
        self._plans_by_now = methods[0] is Metacontrol.analyze
        cached = _cached.setdefault(self._reasoner, {}).setdefault(revision, {})
        self._reasonings: dict[Hashable, Reasoning] = cached if self._is_cacheable else {}
        self.objectives: dict[str, str | None] = {}
        self.groundings: dict[str, str] = {}
        self.components: dict[str, str] = {}
        self.measurements: dict[str, float] = {}
        self._listens_since_s = 0.0  # values that were published before are ignored
        # functions whose objectives were removed since the last cycle began
        self._cancelled: set[str] = set()
        self._recorded_statuses: frozenset[str] = frozenset()
        # functions for which the last plan had no design
        self._without_design: frozenset[str] = frozenset()
        # Measured before the first cycle: signals of which function designs expect a value.
        expected = (
            self._reasoner.expected_attributes
            if revision.waits_for_first_measurement
            else frozenset[str]()
        )
        self._awaited = expected.intersection(system.measurements, scenario.signals)
        self.reads_for_s = self._longest_latency_s = support(settings.latency_s)[1]
        self.period_s = settings.period_s
        if self.period_s is not None:
            self.starts_s = self.first_cycle_s(self.period_s)
        bridge_s = revision.task_bridge_period_s
        self._bridge_phase_s = (
            system.stream("metacontrol/bridge").uniform(0.0, bridge_s) if bridge_s > 0.0 else 0.0
        )
        self._has_objectives_from_launch = bool(system.functions)
        self._add_objectives((*system.functions, *revision.objectives_at_launch))
        may_depend_on_more = system.recorded or "depends_on" not in vars(type(self))
        self._is_event_triggered = not may_depend_on_more and self.depends_on is not None

    def loop_settings(self) -> LoopSettings:
        """Return what the loop works with; called once, before the mission."""
        scenario = self.system.scenario
        return LoopSettings(
            self.system.knowledge(),
            scenario.revision.metacontrol,
            scenario.managers.metacontrol.reasoning_period_s,
            scenario.latencies.inference_s,
        )

    def first_cycle_s(self, period_s: float) -> float:
        """Draw when the first cycle begins; called once, before the mission."""
        return self.system.first_tick_s("metacontrol", period_s)

    # The loop.

    def adapt(self) -> AdaptationProcess | None:
        """Go through the loop once."""
        self.monitor()
        reasoning = self._infer_and_plan()
        if reasoning is None:
            return None
        self._cancelled.clear()
        if self.system.recorded and self.needs_knowledge:
            self.system.log_state(reasoning.inference.state)
        # Later values choose designs, but not the objectives that get one: without a decision a
        # cycle is over.
        if not reasoning.plan.decisions and self._changes_nothing(reasoning):
            return None
        return self.execute(reasoning, self._latency_s(self.system.now_s))

    def _infer_and_plan(self) -> Reasoning | None:
        """Infer and plan by the state of now, and note for how long a cycle that begins now reads
        values.

        Returns:
            None: the cycle waits for objectives, or for values.
        """
        if not self.objectives or not self._awaited <= self.measurements.keys():
            self._note_reading_time(0.0)
            return None
        measured = self._measured_key()
        reasoning = self._analyze_and_plan(measured)
        if self.measurements and measured[1] == tuple(self.measurements.values()):
            # Any other value is another state, though it is in the same region.
            self._note_reading_time(inf)
        elif reasoning.plan.decisions:
            self._note_reading_time(self._longest_latency_s)
        else:
            self._note_reading_time(0.0)
        return reasoning

    def _note_reading_time(self, reads_for_s: float) -> None:
        # A derived class with an `adapt` of its own may read for longer than the loop.
        if type(self).adapt is Metacontrol.adapt:
            self.reads_for_s = reads_for_s

    def _latency_s(self, began_s: float) -> float:
        """Draw how long the cycle that began at a mission time takes to infer."""
        latency_s = self._settings.latency_s
        if isinstance(latency_s, float):
            return latency_s
        # From the cycle's own stream: a recorded mission goes through more cycles.
        return draw(latency_s, self.system.stream(f"metacontrol/inference/{began_s}"))

    def monitor(self) -> None:
        """Read the measured values; components report by themselves, see `diagnostic`."""
        if self._is_listening():
            for attribute in self.system.measurements:
                if (value := self.measured(attribute)) is not None:
                    self.measurements[attribute] = value

    def analyze(self) -> Inference:
        """Infer what the rules say about the current state: which function designs cannot be
        realised (`c_status` FALSE), which groundings are in error, which objectives may change.
        """
        improves = self._revision.always_improve
        objectives = [
            ObjectiveState(name, status, name in improves)
            for name, status in self.objectives.items()
        ]
        state = KnowledgeState.of(
            objectives,
            groundings=self.groundings,
            components=self.components,
            measurements=self.measurements,
        )
        return self._reasoner.analyze(state)

    def plan(self, inference: Inference) -> Plan:
        """Choose function designs for the objectives that need a different one."""
        return self._reasoner.plan(inference, improve_exceeded=self._revision.improve_when_exceeded)

    def execute(self, reasoning: Reasoning, latency_s: float) -> AdaptationProcess:
        """Plan again after the reasoner's latency, by the values of then, and request the plan's
        modes; return whether another cycle would change nothing.
        """
        began_s = self.system.now_s
        measured_before = self._measured_key()
        recovered = self._to_be_forgotten()
        was_idle = self._changes_nothing(reasoning)
        yield self.system.env.timeout(latency_s)
        self.monitor()
        by_now = self._plan_by_now(reasoning, measured_before)
        if self.system.recorded and self.needs_knowledge and reasoning.plan.decisions:
            self.system.log_state(by_now.inference.state, began_s)
        if not was_idle or by_now.plan.designs != reasoning.plan.designs:
            self._log_statuses(reasoning.inference)
            self._carry_out(by_now.plan, recovered, latency_s)
        if not self._is_event_triggered:
            return False
        another = self._infer_and_plan()
        return another is None or self._changes_nothing(another)

    def _log_statuses(self, inference: Inference) -> None:
        if self.system.recorded:
            for line in sorted(inference.statuses - self._recorded_statuses):
                self.system.log("inferred", line)
            self._recorded_statuses = inference.statuses

    def _carry_out(self, plan: Plan, recovered: Collection[str], latency_s: float) -> None:
        """Request a plan's modes, and forget components that had recovered when it was made."""
        grounded = self._request_modes(plan)
        if not grounded.items() <= self.groundings.items():
            self.reasoning_time_s += latency_s
        self.groundings |= grounded
        self.objectives |= dict.fromkeys(grounded, None)  # they are met
        # From now on a recovered component counts as never failed, unless what it made possible was
        # refused: its status keeps that objective updatable, so that the next cycle asks again.
        # Kept for longer, it would make every objective updatable for ever, and in the exemplar's
        # oldest files contradict the status UNGROUNDED of later objectives.
        if not recovered or self._has_met_objective_without(grounded, plan):
            return
        for component in recovered:
            if self.components.get(component) == RECOVERED:
                del self.components[component]

    def _to_be_forgotten(self) -> list[str]:
        """Components that have recovered, if they are forgotten."""
        forgets = self._settings.forgets_recovered
        return [name for name, status in self.components.items() if forgets and status == RECOVERED]

    def _request_modes(self, plan: Plan) -> dict[str, str]:
        """Request the mode of each design of a plan, but for functions that no longer have an
        objective.

        Returns:
            The function designs that are in use from now on, by function.
        """
        grounded = {}
        for decision in plan.decisions:
            function, design = decision.function, decision.design
            if function not in self.objectives or function in self._cancelled:
                continue
            if design is None:
                if function not in self._without_design:
                    self._log_decision("no_design_left", function, decision)
            elif self.system.change_mode(function, design):
                grounded[function] = design
                before = self.groundings.get(function, NO_GROUNDING)
                if before != design:
                    self._log_decision("adaptation", f"{function}: {before} -> {design}", decision)
        self._without_design = plan.without_design
        return grounded

    def _has_met_objective_without(self, grounded: Collection[str], plan: Plan) -> bool:
        """Whether a design was chosen for an objective that is met, and is not among those in use.

        One that is not met is asked for again by its own status.
        """
        return any(
            self.objectives.get(each.function, UNGROUNDED) is None
            for each in plan.decisions
            if each.design is not None and each.function not in grounded
        )

    def _log_decision(self, event: str, what: str, decision: Decision) -> None:
        if self.system.recorded:
            left_out = "".join(
                [f"; not {each.design}: {each.reason}" for each in decision.rejected]
            )
            self.system.log(event, f"{what}: {decision.reason}{left_out}")

    # What changes the state.

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Update a component's status."""
        if self._is_listening() and diagnostic.kind == Kind.COMPONENT_STATUS:
            self.components[diagnostic.key] = str(diagnostic.value)

    def task_requested(self, task: Task) -> None:
        """Add an objective for each function of the task, when the task bridge passes it on."""
        self._pass_on(task, self._add_objectives)

    def task_cancelled(self, task: Task) -> None:
        """Remove the task's objectives with their groundings, when the task bridge passes it on."""
        self._pass_on(task, self._remove_objectives)

    def _pass_on(self, task: Task, update: Callable[[tuple[str, ...]], None]) -> None:
        """Call `update` with the task's functions at the next tick of the exemplar's task bridge,
        if it has a timer.
        """

        def deliver() -> None:
            update(task.functions)
            self.system.state_changed()

        env, period_s = self.system.env, self._revision.task_bridge_period_s
        if period_s > 0.0:
            call_at(env, tick_at_or_after(env.now, self._bridge_phase_s, period_s), deliver)
        else:
            call_next(env, deliver)

    def _add_objectives(self, functions: tuple[str, ...]) -> None:
        if not self._is_listening():
            self._listens_since_s = self.system.now_s
        for function in functions:
            if function not in self.objectives:
                self.objectives[function] = UNGROUNDED
                self.system.log("objective", f"{function} {UNGROUNDED}")

    def _remove_objectives(self, functions: tuple[str, ...]) -> None:
        self.monitor()  # later measurements may be ignored
        if self._revision.executes_plans_of_removed_objectives:
            self._execute_plan_under_way(functions)
        self._cancelled.update(functions)
        for function in functions:
            self.objectives.pop(function, None)
            self.groundings.pop(function, None)
            self.system.change_mode(function, UNGROUND_MODE)

    def _execute_plan_under_way(self, functions: tuple[str, ...]) -> None:
        """Have the modes requested all the same that the cycle under way, if any, chooses for
        functions.

        So a search goes on although its task is over, and disturbs what follows. Cycles that change
        nothing are left out (see `depends_on`), so the plan is made here; what has changed
        since the cycle began counts as well.
        """
        assert self.period_s is not None  # revisions have metacontrol's
        env = self.system.env
        if not self.objectives or env.now < self.starts_s:
            return
        # As the cycles' times are summed up: the time names the stream of the cycle's latency.
        began_s = self.starts_s
        while began_s + self.period_s <= env.now:
            began_s += self.period_s
        ends_s = began_s + self._latency_s(began_s)
        if env.now >= ends_s:
            return
        measured_before = self._measured_key()
        reasoning = self._analyze_and_plan(measured_before)

        def carry_out() -> None:
            self.monitor()
            for decision in self._plan_by_now(reasoning, measured_before).plan.decisions:
                if decision.function in functions and decision.design is not None:
                    self.system.change_mode(decision.function, decision.design)

        call_at(env, ends_s, carry_out)

    # Queries of the loop.

    def measured(self, attribute: str) -> float | None:
        """Look up the value of a quality attribute for `monitor`; None if nothing was published."""
        return self.system.measured(attribute, self._listens_since_s)

    @property
    def depends_on(self) -> Dependencies | None:
        """The numbers in the knowledge base, if the rules only compare measured values with
        them.
        """
        thresholds = self._reasoner.thresholds
        if thresholds is None:
            return None
        if (
            self._revision.ignores_diagnostics_without_objective
            and not self._has_objectives_from_launch
        ):
            return None  # then it also depends on when a value was published
        return dict.fromkeys(self.system.measurements, thresholds)

    def _analyze_and_plan(self, measured: _MeasuredKey) -> Reasoning:
        """Analyze and plan, or look up the cached result for an equal state.

        Args:
            measured: the key of the measured values.
        """
        key = self._reported_key(), measured
        reasoning = self._reasonings.get(key)
        if reasoning is None:
            inference = self.analyze()
            reasoning = Reasoning(inference, self.plan(inference))
            self._keep(key, reasoning)
        return reasoning

    def _plan_by_now(self, reasoning: Reasoning, measured_before: _MeasuredKey) -> Reasoning:
        """Choose designs with the values that are measured now, after the reasoner has inferred
        something of those before.
        """
        measured_now = self._measured_key()
        if measured_now == measured_before or not self._plans_by_now:
            return reasoning
        key = reasoning.inference.state, measured_now
        found = self._reasonings.get(key)
        if found is None:
            values = [(name, exact(value)) for name, value in sorted(self.measurements.items())]
            state = replace(reasoning.inference.state, measured_since=tuple(values))
            inference = replace(reasoning.inference, state=state)
            found = Reasoning(inference, self.plan(inference))
            self._keep(key, found)
        return found

    def _keep(self, key: Hashable, reasoning: Reasoning) -> None:
        """Keep what was inferred and planned."""
        if self._is_cacheable:
            if len(self._reasonings) >= _MAX_CACHED:
                self._reasonings.clear()
            self._reasonings[key] = reasoning

    def _reported_key(self) -> Hashable:
        """Make the key of the state but for what is measured."""
        return (
            tuple(self.objectives.items()),
            tuple(self.groundings.items()),
            tuple(self.components.items()),
        )

    def _measured_key(self) -> _MeasuredKey:
        """Make the key of the measured values: their regions, or, if the mission is recorded or what
        follows may depend on more, the values.
        """
        measured = self.measurements.values()
        if self.system.recorded or not self._is_cacheable:
            return tuple(self.measurements), tuple(measured)
        return tuple(self.measurements), self._reasoner.distinguished(measured)

    def _changes_nothing(self, reasoning: Reasoning) -> bool:
        """Return whether executing a plan would change nothing, and record nothing."""
        # A latency of a period or more must pass even so: cycles that come due meanwhile are
        # skipped.
        is_late = self.period_s is not None and self._longest_latency_s >= self.period_s
        if is_late or self._to_be_forgotten():
            return False
        if self.system.recorded:
            if reasoning.inference.statuses - self._recorded_statuses:
                return False
            self._recorded_statuses = reasoning.inference.statuses
        current_mode = self.system.modes.current_mode
        for decision in reasoning.plan.decisions:
            function, design = decision.function, decision.design
            is_met = self.objectives[function] is None
            in_use = self.groundings.get(function), current_mode(function)
            if design is not None and not (is_met and in_use == (design, design)):
                return False
        return reasoning.plan.without_design == self._without_design

    def _is_listening(self) -> bool:
        return bool(self.objectives) or not self._revision.ignores_diagnostics_without_objective
