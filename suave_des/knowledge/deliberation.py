"""Analyze and plan: the managing subsystem's queries to its knowledge base in each cycle of the MAPE-K loop."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import plan
from suave_des.knowledge.reasoners import Reasoner
from suave_des.knowledge.regions import Regions
from suave_des.knowledge.state import Inference, KnowledgeState, Plan

#: What happens to a function's grounding that gets no other design.
STAYS: Final = "stays"
NONE_LEFT: Final = "none left"


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
        """New design of each function whose grounding changes, or NONE_LEFT if no design is left."""
        state = self.inference.state
        outcomes = {each.function: each.design or NONE_LEFT for each in self.plan.decisions}
        return {function: outcome for function, outcome in outcomes.items() if outcome != state.grounded(function)}

    @cached_property
    def statuses(self) -> frozenset[str]:
        """Inferred statuses of objectives and groundings, as text."""
        return frozenset(_statuses(self.inference))


class Deliberation:
    """A knowledge base with a reasoner; analyzes states and plans on them.

    Both are pure functions of the state. Reasoners cache inferences, by state or by what the rules can tell of it;
    metacontrol caches conclusions, by its symbolic state.

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

    def analyze_and_plan(self, state: KnowledgeState, *, improve_exceeded: bool = False) -> Conclusion:
        """Analyze a state and plan on it.

        Args:
            state: objectives, groundings, reported components and measured values.
            improve_exceeded: whether an objective is also adapted when a measured value exceeds what its current
                function design expects (the exemplar's revision 2023 does so in code).

        Raises:
            KnowledgeError: the state and the ontologies contradict one another.
        """
        inference = self.analyze(state)
        return Conclusion(inference, self.plan(inference, improve_exceeded=improve_exceeded))

    def analyze(self, state: KnowledgeState) -> Inference:
        """Infer what the rules say about a state; see `analyze_and_plan`."""
        return self.reasoner.infer(state)

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Choose function designs for the objectives to adapt; see `analyze_and_plan`."""
        return plan(self.base, inference, improve_exceeded=improve_exceeded)

    @property
    def thresholds(self) -> tuple[float, ...] | None:
        """The numbers with which rules compare measured values; None if rules may do more than compare."""
        return self.regions.thresholds_as_floats if self.regions is not None and self.regions.is_sound else None

    def distinguished(self, measured: Collection[float]) -> Hashable:
        """What the rules can distinguish in measured values: the bounds of their regions, or the values themselves."""
        if self.regions is None or not all(map(isfinite, measured)):
            return tuple(measured)
        bounds = tuple(map(self.regions.around, measured))
        # Of two values in one gap between thresholds rules can tell which is the greater.
        return bounds if len(bounds) == 1 or len(set(bounds)) == len(bounds) else tuple(measured)

    @cached_property
    def expected_attributes(self) -> frozenset[str]:
        """The quality attributes of which some function design expects a value."""
        designs = [design for function in self.base.functions for design in self.base.designs(function)]
        return frozenset(attribute for design in designs for attribute in self.base.expected(design))


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
