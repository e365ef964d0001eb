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

from suave_des.clock import tick_at_or_after, until
from suave_des.knowledge.deliberation import REMEMBERED, Conclusion, Deliberation
from suave_des.knowledge.state import Decision, KnowledgeState, ObjectiveState
from suave_des.managed.task import SEARCH, Task
from suave_des.managing.base import AdaptationProcess, Bounds, ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import RECOVERED, Diagnostic, Kind
from suave_des.scenario.distributions import draw
from suave_des.scenario.modes import UNGROUND_MODE

UNGROUNDED = "UNGROUNDED"

_NO_VALUE = (0.0, 0.0)
"""Bounds that no value is between."""

_Values = tuple[float | None, ...]
_Known = dict[_Values, Conclusion]
"""Conclusions by measured values, while all else that is known stays the same."""

_memories: WeakKeyDictionary[Deliberation, dict[object, _Known]] = WeakKeyDictionary()
"""What was concluded, by all else that is known: so that a state is built only for what is new."""


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
        self._objectives: dict[str, str | None] = {}
        self._groundings: dict[str, str] = {}
        self._components: dict[str, str] = {}
        self._attributes = tuple(sorted(system.measurements))
        self._awaited = self._attributes_to_await()
        self._listens_since_s = 0.0
        self._heard_before: dict[str, float | None] = {}
        self._values: _Values = (None,) * len(self._attributes)
        self._known: _Known | None = None
        self._situations = _memories.setdefault(self._deliberation, {})
        self._on_the_bridge = 0
        self._cancelled: set[str] = set()
        self._told: frozenset[str] = frozenset()
        self._without_design: frozenset[str] = frozenset()
        latency = system.scenario.latencies.inference_s
        # A cycle that draws its latency draws each time, and may last for more than a period.
        self._regions = self._deliberation.regions if isinstance(latency, float) else None
        self._inference_time_s: Callable[[], float] = (
            (lambda: latency)
            if isinstance(latency, float)
            else partial(draw, latency, system.stream("metacontrol/inference"))
        )
        self._cycle_s = system.scenario.managers.metacontrol.reasoning_period_s
        self.period_s = self._cycle_s
        self.starts_s = system.stream("metacontrol/phase").uniform(0.0, self._cycle_s)
        if self._revision.task_bridge_period_s > 0.0:
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
        """Monitor: update what is known of components."""
        if self._listens() and diagnostic.kind == Kind.COMPONENT_STATUS:
            self._components[diagnostic.key] = str(diagnostic.value)
            self._known = None

    def measured(self, attribute: str) -> float | None:
        """Monitor: the value of a quality attribute that is known now, none if there is none."""
        if self._listens():
            value = self.system.measured(attribute, self._listens_since_s)
            if value is not None:
                return value
        return self._heard_before.get(attribute)

    def adapt(self) -> AdaptationProcess | None:
        """Analyze and plan on the state as it is now; execute when the reasoner has taken its time."""
        self._values = values = tuple([self.measured(attribute) for attribute in self._attributes])
        if not self._objectives:
            return None
        if any(values[place] is None for place in self._awaited):
            return None
        self._cancelled.clear()
        conclusion = self._conclude(values)
        self.system.reasoned(conclusion.inference.state)
        latency_s = self._inference_time_s()
        if self._changes_nothing(conclusion) and latency_s < self._cycle_s:
            return None  # and it will be over before the next cycle
        return self._execute(conclusion, latency_s)

    def rests_while(self) -> Bounds | None:
        """While measured values stay in their regions a cycle concludes what this one did, and changes nothing."""
        regions = self._regions
        if regions is None or self._on_the_bridge:
            return None
        bounds = {
            attribute: _NO_VALUE if value is None else regions.around(value)
            for attribute, value in zip(self._attributes, self._values, strict=True)
        }
        # Of two values in one gap between thresholds rules can tell which is the greater.
        return bounds if len(set(bounds.values())) == len(bounds) else None

    def _listens(self) -> bool:
        return bool(self._objectives) or not self._revision.ignores_diagnostics_without_objective

    def _conclude(self, values: _Values) -> Conclusion:
        if self._known is None:
            self._known = self._known_in_situation()
        conclusion = self._known.get(values)
        if conclusion is None:
            if sum(map(len, self._situations.values())) >= REMEMBERED:
                for known in self._situations.values():
                    known.clear()
            conclusion = self._known[values] = self._deliberation.conclude(
                self._state(values), improve_exceeded=self._revision.search_improves_when_exceeded
            )
        return conclusion

    def _known_in_situation(self) -> _Known:
        situation = (
            self._revision.search_always_improves,
            self._revision.search_improves_when_exceeded,
            self._attributes,
            *map(tuple, (self._objectives.items(), self._groundings.items(), self._components.items())),
        )
        return self._situations.setdefault(situation, {})

    def _changes_nothing(self, conclusion: Conclusion) -> bool:
        return (
            conclusion.statuses == self._told
            and not self._without_design
            and RECOVERED not in self._components.values()
            and all(self._is_carried_out(decision) for decision in conclusion.plan.decisions)
        )

    def _is_carried_out(self, decision: Decision) -> bool:
        function, design = decision.function, decision.design
        return (
            design is not None
            and self._groundings.get(function) == design == self.system.modes.current_mode(function)
            and self._objectives[function] is None
        )

    def _over_the_bridge(self, task: Task, *, requested: bool) -> AdaptationProcess:
        period_s = self._revision.task_bridge_period_s
        if period_s > 0.0:
            self._on_the_bridge += 1
            yield until(self.system.env, tick_at_or_after(self.system.now_s, self._bridge_phase_s, period_s))
            self._on_the_bridge -= 1
        if requested:
            self._add_objectives(task.functions)
        else:
            self._remove_objectives(task.functions)

    def _add_objectives(self, functions: Iterable[str]) -> None:
        if not self._listens():
            self._listens_since_s = self.system.now_s
        self._known = None
        for function in functions:
            if function not in self._objectives:
                self._objectives[function] = UNGROUNDED
                self.system.log("objective", f"{function} {UNGROUNDED}")

    def _remove_objectives(self, functions: Iterable[str]) -> None:
        heard = {attribute: self.measured(attribute) for attribute in self._attributes}
        for function in functions:
            self._objectives.pop(function, None)
            self._groundings.pop(function, None)
            self._cancelled.add(function)
            self.system.change_mode(function, UNGROUND_MODE)
        self._known = None
        if not self._listens():
            self._heard_before = heard

    def _state(self, values: _Values) -> KnowledgeState:
        known = zip(self._attributes, values, strict=True)
        always = self._revision.search_always_improves
        return KnowledgeState.of(
            objectives=[
                ObjectiveState(function, status, always and function == SEARCH)
                for function, status in self._objectives.items()
            ],
            groundings=self._groundings,
            components=self._components,
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
        recovered = [component for component, status in self._components.items() if status == RECOVERED]
        yield self.system.env.timeout(latency_s)
        self._tell(conclusion.statuses)
        for decision in conclusion.plan.decisions:
            if decision.function in self._objectives and decision.function not in self._cancelled:
                self._carry_out(decision)
        self._without_design = frozenset(each.function for each in conclusion.plan.decisions if each.design is None)
        # A recovery is news once: it has been reasoned about, and from now on the component is as if it had never
        # failed. Kept, it would make every objective updatable for ever, and in the exemplar's oldest files, where the
        # status says so, contradict the UNGROUNDED of each objective to come.
        for component in recovered:
            if self._components.get(component) == RECOVERED:
                del self._components[component]
        self._known = None

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
