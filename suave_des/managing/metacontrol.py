"""Metacontrol: a MAPE-K loop over an OWL knowledge base (paper, section on Metacontrol; kas-lab/suave).

Monitor: diagnostics update the state of the knowledge. Analyze: a reasoner infers what the rules say about that state.
Plan: the best function design for each objective that needs one. Execute: request the design's mode, which has its
name.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import ClassVar
from weakref import WeakKeyDictionary

import simpy

from suave_des.clock import call_at, call_next, tick_at_or_after
from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.state import Decision, KnowledgeState, ObjectiveState
from suave_des.managed.task import SEARCH, Task
from suave_des.managing.base import AdaptationProcess, Bounds, ManagedSystem, ManagingSubsystem
from suave_des.managing.situations import UNGROUNDED, Situations, Values, cancelled, executed, reported, requested
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.scenario.modes import UNGROUND_MODE
from suave_des.scenario.quantities import draw

_memories: WeakKeyDictionary[Deliberation, dict[object, Situations]] = WeakKeyDictionary()
"""Situations that were met, by what is the same in a mission."""

_ROUNDING_S = 1e-9


class Metacontrol(ManagingSubsystem):
    """The metacontrol manager.

    What it knows is an explicit state: objectives and their status, groundings, reported components, measured values.
    What the reasoner infers from it is never written back, so nothing has to be retracted; a status persists only as a
    transition of this state.
    """

    needs_knowledge: ClassVar[bool] = True
    hears: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._revision = system.scenario.revision.metacontrol
        self._deliberation: Deliberation = system.knowledge()
        self._attributes = tuple(sorted(system.measurements))
        self._awaited = self._attributes_to_await()
        self._listens_since_s = 0.0
        self._heard_before: dict[str, float | None] = {}
        self._values: Values = (None,) * len(self._attributes)
        # What changes nothing but the record is left out where nobody keeps it, and no derived class does more.
        self._is_brief = not system.recorded and type(self) is Metacontrol
        self._is_complete = system.recorded or "rests_while" not in vars(type(self))
        self._situations = self._situations_of_missions_like_this()
        self._situation = self._situations.first()
        self._on_the_bridge = 0
        self._cancelled: set[str] = set()
        self._told: frozenset[str] = frozenset()
        self._without_design: frozenset[str] = frozenset()
        latency = system.scenario.latencies.inference_s
        self._inference_time_s: Callable[[], float] = (
            (lambda: latency)
            if isinstance(latency, float)
            else partial(draw, latency, system.stream("metacontrol/inference"))
        )
        self._latency_s = latency if isinstance(latency, float) else None
        self._cycle_s = system.scenario.managers.metacontrol.reasoning_period_s
        self.period_s = self._cycle_s
        self.starts_s = system.stream("metacontrol/phase").uniform(0.0, self._cycle_s)
        if self._revision.task_bridge_period_s > 0.0:
            bridge_period_s = self._revision.task_bridge_period_s
            self._bridge_phase_s = system.stream("metacontrol/bridge").uniform(0.0, bridge_period_s)
        self._add_objectives(system.lasting_functions)
        if self._revision.objectives_at_launch:
            self._add_objectives((SEARCH,))

    def task_requested(self, task: Task) -> None:
        """Add an objective for each function of the task, when the task bridge passes it on."""
        self._over_the_bridge(self._add_objectives, task)

    def task_cancelled(self, task: Task) -> None:
        """Remove the task's objectives with their groundings, when the task bridge passes it on."""
        self._over_the_bridge(self._remove_objectives, task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Monitor: update what is known of components."""
        if self._listens() and diagnostic.kind == Kind.COMPONENT_STATUS:
            self._situation = self._situation.after(reported, diagnostic.key, str(diagnostic.value))

    def measured(self, attribute: str) -> float | None:
        """Monitor: the value of a quality attribute that is known now, none if there is none."""
        if self._listens():
            value = self.system.measured(attribute, self._listens_since_s)
            if value is not None:
                return value
        return self._heard_before.get(attribute)

    def adapt(self) -> AdaptationProcess | None:
        """Analyze and plan on the state as it is now; execute when the reasoner has taken its time."""
        self._values = values = self._measured_now()
        if self._waits_for(values):
            return None
        self._cancelled.clear()
        conclusion = self._conclude(values)
        self.system.reasoned(conclusion.inference.state)
        latency_s = self._inference_time_s()
        if latency_s < self._cycle_s and self._changes_nothing(conclusion, latency_s):
            return None  # and it will be over before the next cycle
        return self._execute(conclusion, latency_s)

    def rests_while(self) -> Bounds | None:
        """While measured values stay in regions of which it is known that a cycle changes nothing."""
        return self._rest(self._values)

    def rests_after(self) -> Bounds | None:
        """The same, if a cycle would change nothing now."""
        return self._rest(self._measured_now())

    def _situations_of_missions_like_this(self) -> Situations:
        known = _memories.get(self._deliberation)
        if known is None:
            known = _memories.setdefault(self._deliberation, {})
        revision = self._revision
        same = (
            self._is_complete,
            revision.search_always_improves,
            revision.search_improves_when_exceeded,
            self._attributes,
        )
        if same not in known:
            # The words of a conclusion name the measured values: for the record each has its own.
            known[same] = Situations(self._attributes, None if self._is_complete else self._deliberation.regions)
        return known[same]

    def _measured_now(self) -> Values:
        return tuple([self.measured(attribute) for attribute in self._attributes])

    def _waits_for(self, values: Values) -> bool:
        """Whether there is nothing to reason about yet."""
        if not self._situation.objectives:
            return True
        return bool(self._awaited) and any(values[place] is None for place in self._awaited)

    def _rest(self, values: Values) -> Bounds | None:
        situations, situation, latency_s = self._situations, self._situation, self._latency_s
        if latency_s is None or latency_s >= self._cycle_s or not self._is_over_in_time(latency_s):
            return None  # a cycle that draws its latency draws each time; one that takes long leaves the next one out
        if situations.regions is None or self._on_the_bridge or not self._are_in_force(situation.groundings.items()):
            return None
        region = situations.region(values)
        if self._waits_for(values):
            return situations.bounds(region)
        if self._is_brief:
            return situation.rest(region)
        conclusion = situation.conclusion(region)
        is_done = conclusion is not None and situation.is_met_by(conclusion) and self._is_told(conclusion)
        return situations.bounds(region) if is_done else None

    def _is_over_in_time(self, latency_s: float) -> bool:
        """Whether a cycle is over before the next one, with all rounding errors."""
        return self.period_s is not None and latency_s + _ROUNDING_S < self.period_s

    def _listens(self) -> bool:
        return bool(self._situation.objectives) or not self._revision.ignores_diagnostics_without_objective

    def _conclude(self, values: Values) -> Conclusion:
        region = self._situations.region(values)
        conclusion = self._situation.conclusion(region)
        if conclusion is None:
            conclusion = self._deliberation.analyze_and_plan(
                self._state(values), improve_exceeded=self._revision.search_improves_when_exceeded
            )
            self._situation.remember(region, conclusion)
        return conclusion

    def _changes_nothing(self, conclusion: Conclusion, latency_s: float) -> bool:
        if not self._situation.is_met_by(conclusion):
            return False
        if not (self._is_told(conclusion) or self._is_for_the_record(latency_s)):
            return False
        designs = [(each.function, each.design) for each in conclusion.plan.decisions if each.design is not None]
        return self._are_in_force(designs)

    def _is_for_the_record(self, latency_s: float) -> bool:
        """Whether nothing depends on a cycle that only tells something.

        The clock comes to the next cycle from here as from the end of this one: times until twice the present one are
        not rounded.
        """
        in_time = self._is_brief and self._is_over_in_time(latency_s)
        return in_time and self.period_s is not None and self.period_s <= self.system.env.now

    def _is_told(self, conclusion: Conclusion) -> bool:
        """Whether the record has it all."""
        return (
            conclusion.statuses == self._told
            and not self._without_design
            and all(decision.design is not None for decision in conclusion.plan.decisions)
        )

    def _are_in_force(self, designs: Iterable[tuple[str, str]]) -> bool:
        """Whether function designs are the modes that were requested last."""
        current_mode = self.system.modes.current_mode
        return all(current_mode(function) == design for function, design in designs)

    def _over_the_bridge(self, change: Callable[[tuple[str, ...]], None], task: Task) -> None:
        def arrive(_: simpy.Event) -> None:
            self._on_the_bridge -= 1
            change(task.functions)

        self._on_the_bridge += 1
        env, period_s = self.system.env, self._revision.task_bridge_period_s
        if period_s > 0.0:
            call_at(env, tick_at_or_after(env.now, self._bridge_phase_s, period_s), arrive)
        else:
            call_next(env, arrive)

    def _add_objectives(self, functions: tuple[str, ...]) -> None:
        if not self._listens():
            self._listens_since_s = self.system.now_s
        before = self._situation.objectives
        self._situation = self._situation.after(requested, functions)
        if self.system.recorded:
            for function in dict.fromkeys(functions):
                if function not in before:
                    self.system.log("objective", f"{function} {UNGROUNDED}")

    def _remove_objectives(self, functions: tuple[str, ...]) -> None:
        heard = {attribute: self.measured(attribute) for attribute in self._attributes}
        self._situation = self._situation.after(cancelled, functions)
        self._cancelled.update(functions)
        for function in functions:
            self.system.change_mode(function, UNGROUND_MODE)
        if not self._listens():
            self._heard_before = heard

    def _state(self, values: Values) -> KnowledgeState:
        known = zip(self._attributes, values, strict=True)
        always = self._revision.search_always_improves
        situation = self._situation
        return KnowledgeState.of(
            objectives=[
                ObjectiveState(function, status, always and function == SEARCH)
                for function, status in situation.objectives.items()
            ],
            groundings=situation.groundings,
            components=situation.components,
            measurements={attribute: value for attribute, value in known if value is not None},
        )

    def _attributes_to_await(self) -> list[int]:
        """Places of the measured attributes that some function design expects a value of."""
        if not self._revision.waits_for_first_measurement:
            return []
        base = self._deliberation.base
        expected = {
            attribute
            for function in base.functions
            for design in base.designs(function)
            for attribute in base.expected(design)
        }
        signals = self.system.scenario.signals
        return [place for place, name in enumerate(self._attributes) if name in expected and name in signals]

    def _execute(self, conclusion: Conclusion, latency_s: float) -> AdaptationProcess:
        recovered = self._situation.recovered
        yield simpy.Timeout(self.system.env, latency_s)
        self._tell(conclusion.statuses)
        decisions = conclusion.plan.decisions
        grounded = tuple(
            [
                (decision.function, decision.design)
                for decision in decisions
                if decision.function in self._situation.objectives
                and decision.function not in self._cancelled
                and self._carry_out(decision)
            ]
        )
        self._without_design = frozenset([each.function for each in decisions if each.design is None])
        self._situation = self._situation.after(executed, grounded, recovered)

    def _carry_out(self, decision: Decision) -> bool:
        """Request a decision's design; false if there is none."""
        function, design = decision.function, decision.design
        if design is None:
            if function not in self._without_design:  # else only the measured values in the reasons are others
                self._log("no_design_left", decision, function)
            return False
        if not self.system.change_mode(function, design):
            return False
        before = self._situation.groundings.get(function, "ungrounded")
        if before != design:
            self._log("adaptation", decision, f"{function}: {before} -> {design}")
        return True

    def _tell(self, statuses: frozenset[str]) -> None:
        if self.system.recorded:
            for line in sorted(statuses - self._told):
                self.system.log("inferred", line)
        self._told = statuses

    def _log(self, event: str, decision: Decision, what: str) -> None:
        if self.system.recorded:
            left_out = "".join([f"; not {each.design}: {each.reason}" for each in decision.rejected])
            self.system.log(event, f"{what}: {decision.reason}{left_out}")
