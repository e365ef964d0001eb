"""Analyze and plan: what the managing subsystem asks of its knowledge base in each cycle of the MAPE-K loop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import plan
from suave_des.knowledge.reasoners import Reasoner
from suave_des.knowledge.regions import Regions
from suave_des.knowledge.state import Inference, KnowledgeState, Plan

#: What happens to a function's grounding that gets no other design.
STAYS: Final = "stays"
NONE_LEFT: Final = "none left"
#: Conclusions kept by a Deliberation; the least recently used are dropped.
CACHED_CONCLUSIONS: Final = 16384


@dataclass(frozen=True)
class Conclusion:
    """The result of analyzing a state and planning on it.

    Attributes:
        inference: what the reasoner added to the state.
        plan: decisions for the objectives to adapt.
    """

    inference: Inference
    plan: Plan

    @cached_property
    def changes(self) -> dict[str, str]:
        """What happens to each function's grounding that changes or has no design left: a design, or NONE_LEFT."""
        state = self.inference.state
        outcomes = {each.function: each.design or NONE_LEFT for each in self.plan.decisions}
        return {function: outcome for function, outcome in outcomes.items() if outcome != state.grounded(function)}

    @cached_property
    def statuses(self) -> frozenset[str]:
        """What was inferred of objectives and groundings, in words."""
        return frozenset(_statuses(self.inference))


class Deliberation:
    """A knowledge base with a reasoner; analyzes states and plans on them.

    Both are pure functions of the state, so conclusions are cached.

        base = Ontology.load()
        deliberation = Deliberation(base, make_reasoner("pellet", base))
        state = KnowledgeState.of([ObjectiveState("f_generate_search_path", "UNGROUNDED")])
        deliberation.analyze_and_plan(state).plan.decisions[0].design  # "fd_spiral_high"

    Args:
        base: the knowledge base.
        reasoner: does the analysis.

    Attributes:
        regions: the regions of measured values within which inferences are equal; None if the reasoner has none.
    """

    def __init__(self, base: Ontology, reasoner: Reasoner) -> None:
        self.base = base
        self.reasoner = reasoner
        self.regions: Regions | None = getattr(reasoner, "regions", None)
        self._cached = lru_cache(maxsize=CACHED_CONCLUSIONS)(self._analyze_and_plan)

    def analyze_and_plan(self, state: KnowledgeState, *, improve_exceeded: bool = False) -> Conclusion:
        """Analyze a state and plan on it.

        Args:
            state: objectives, groundings, reported components and measured values.
            improve_exceeded: whether an objective is also adapted when a measured value exceeds what its present
                function design expects (the exemplar's revision 2023 does so in code).

        Raises:
            KnowledgeError: the state and the ontologies contradict one another.
        """
        return self._cached(state, improve_exceeded)

    def analyze(self, state: KnowledgeState) -> Inference:
        """Infer what the rules say about a state; see `analyze_and_plan`."""
        return self.reasoner.infer(state)

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Choose function designs for the objectives to adapt; see `analyze_and_plan`."""
        return plan(self.base, inference, improve_exceeded=improve_exceeded)

    def _analyze_and_plan(self, state: KnowledgeState, improve_exceeded: bool) -> Conclusion:
        inference = self.analyze(state)
        return Conclusion(inference, self.plan(inference, improve_exceeded=improve_exceeded))


def _statuses(inference: Inference) -> Iterator[str]:
    state = inference.state
    for objective in state.objectives:
        status = inference.objective_status(objective.function)
        if status is not None and status != objective.status:
            yield f"objective of {objective.function} is {status}"
        if inference.is_updatable(objective.function) and not objective.always_improve:
            yield f"objective of {objective.function} is updatable"
    for function, design in state.groundings:
        status = inference.grounding_status(function)
        if status is not None:
            yield f"grounding of {design} is {status}"
