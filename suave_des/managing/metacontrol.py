"""Metacontrol: a MAPE-K loop over an OWL knowledge base (paper, section on Metacontrol; kas-lab/suave).

Monitor: diagnostics update the state of the knowledge. Analyze: a reasoner infers what the rules say about that state.
Plan: the best function design for each objective that needs one. Execute: request the design's mode, which has its
name.
"""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal
from typing import ClassVar

from suave_des.clock import tick_at_or_after, until
from suave_des.knowledge.deliberation import Deliberation
from suave_des.knowledge.state import Decision, KnowledgeState, ObjectiveState, Plan
from suave_des.managed.coordinator import SEARCH, Task
from suave_des.managing.base import AdaptationProcess, ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, Kind
from suave_des.scenario.distributions import draw
from suave_des.scenario.modes import UNGROUND_MODE

UNGROUNDED = "UNGROUNDED"


class Metacontrol(ManagingSubsystem):
    """The metacontrol manager.

    What it knows is an explicit state: objectives and their status, groundings, reported components, measured values.
    What the reasoner infers from it is never written back, so nothing has to be retracted; a status persists only as a
    transition of this state.
    """

    needs_knowledge: ClassVar[bool] = True

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._revision = system.scenario.revision.metacontrol
        self._deliberation: Deliberation = system.knowledge()
        self._awaited = self._attributes_to_await()
        self._objectives: dict[str, str | None] = {}
        self._groundings: dict[str, str] = {}
        self._components: dict[str, str] = {}
        self._measurements: dict[str, Decimal] = {}
        self._cancelled: set[str] = set()
        self._told: frozenset[str] = frozenset()
        self._without_design: frozenset[str] = frozenset()
        self._latency_stream = system.stream("metacontrol/inference")
        self.period_s = system.scenario.managers.metacontrol.reasoning_period_s
        self.starts_s = system.stream("metacontrol/phase").uniform(0.0, self.period_s)
        bridge_period_s = self._revision.task_bridge_period_s
        self._bridge_phase_s = system.stream("metacontrol/bridge").uniform(0.0, bridge_period_s)
        self._add_objectives(system.lasting_functions)
        if self._revision.objectives_at_launch:
            self._add_objectives([SEARCH])

    def task_requested(self, task: Task) -> None:
        """Add an objective for each function of the task, when the task bridge passes it on."""
        self.system.env.process(self._over_the_bridge(task, requested=True))

    def task_cancelled(self, task: Task) -> None:
        """Remove the task's objectives with their groundings, when the task bridge passes it on."""
        self.system.env.process(self._over_the_bridge(task, requested=False))

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Monitor: update what is known of components and quality attributes."""
        if self._revision.ignores_diagnostics_without_objective and not self._objectives:
            return
        if diagnostic.kind == Kind.COMPONENT_STATUS:
            self._components[diagnostic.key] = str(diagnostic.value)
        else:
            self._measurements[diagnostic.key] = Decimal(repr(float(diagnostic.value)))

    def adapt(self) -> AdaptationProcess:
        """Analyze and plan on the state as it is now; execute when the reasoner has taken its time."""
        if not self._objectives or self._waits_for_measurement():
            return
        state = self._state()
        self._cancelled.clear()
        self.system.reasoned(state)
        conclusion = self._deliberation.conclude(state, improve_exceeded=self._revision.search_improves_when_exceeded)
        yield self.system.env.timeout(draw(self.system.scenario.latencies.inference_s, self._latency_stream))
        self._tell(conclusion.statuses)
        self._execute(conclusion.plan)
        self._settle(state)

    def _over_the_bridge(self, task: Task, *, requested: bool) -> AdaptationProcess:
        period_s = self._revision.task_bridge_period_s
        if period_s > 0.0:
            tick_s = tick_at_or_after(self.system.now_s, self._bridge_phase_s, period_s)
            yield until(self.system.env, tick_s)
        if requested:
            self._add_objectives(task.functions)
            return
        for function in task.functions:
            self._objectives.pop(function, None)
            self._groundings.pop(function, None)
            self._cancelled.add(function)
            self.system.change_mode(function, UNGROUND_MODE)

    def _add_objectives(self, functions: Iterable[str]) -> None:
        for function in functions:
            if function not in self._objectives:
                self._objectives[function] = UNGROUNDED
                self.system.log("objective", f"{function} {UNGROUNDED}")

    def _state(self) -> KnowledgeState:
        always = self._revision.search_always_improves
        return KnowledgeState.of(
            objectives=[
                ObjectiveState(function, status, always and function == SEARCH)
                for function, status in self._objectives.items()
            ],
            groundings=self._groundings,
            components=self._components,
            measurements=self._measurements,
        )

    def _attributes_to_await(self) -> frozenset[str]:
        """Attributes that some function design expects a value of and that this mission measures."""
        if not self._revision.waits_for_first_measurement:
            return frozenset()
        base = self._deliberation.base
        expected = {
            attribute
            for function in base.functions
            for design in base.designs(function)
            for attribute in base.expected(design)
        }
        return frozenset(expected.intersection(self.system.scenario.signals))

    def _waits_for_measurement(self) -> bool:
        return not self._awaited <= self._measurements.keys()

    def _execute(self, decided: Plan) -> None:
        for decision in decided.decisions:
            if decision.function in self._objectives and decision.function not in self._cancelled:
                self._carry_out(decision)
        self._without_design = frozenset(each.function for each in decided.decisions if each.design is None)

    def _settle(self, state: KnowledgeState) -> None:
        """A recovery is news once: it has been reasoned about, and from now on the component is as if never failed.

        Kept, it would make every objective updatable for ever, and in the exemplar's oldest files, where the status
        says so, contradict the UNGROUNDED of each objective to come.
        """
        for component, status in state.components:
            if status == RECOVERED and self._components.get(component) == RECOVERED:
                del self._components[component]

    def _carry_out(self, decision: Decision) -> None:
        function, design = decision.function, decision.design
        if design is None:
            if function in self._without_design:  # told already: only the measured values in the reasons are others
                return
            self.system.log("no_design_left", f"{function}: {decision.reason}{_left_out(decision)}")
            return
        if self.system.change_mode(function, design):
            if self._groundings.get(function) != design:
                before = self._groundings.get(function, "ungrounded")
                why = f"{decision.reason}{_left_out(decision)}"
                self.system.log("adaptation", f"{function}: {before} -> {design}: {why}")
            self._groundings[function] = design
            self._objectives[function] = None

    def _tell(self, statuses: frozenset[str]) -> None:
        for line in sorted(statuses - self._told):
            self.system.log("inferred", line)
        self._told = statuses


def _left_out(decision: Decision) -> str:
    """The designs that were left out, with the reason of each."""
    return "".join(f"; not {each.design}: {each.reason}" for each in decision.rejected)
