"""Analyze and plan in one: a pure function of the state, and so remembered like the inferences that it rests on."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.planning import plan
from suave_des.knowledge.reasoners import Reasoner
from suave_des.knowledge.regions import Regions
from suave_des.knowledge.state import Inference, KnowledgeState, Plan

#: Conclusions that are remembered.
REMEMBERED: Final = 16384


@dataclass(frozen=True, slots=True)
class Conclusion:
    """What a state entails and asks for.

    Attributes:
        inference: what the reasoner added to the state.
        plan: decisions for the objectives to adapt.
        statuses: what was inferred of objectives and groundings, in words.
    """

    inference: Inference
    plan: Plan
    statuses: frozenset[str]


class Deliberation:
    """A knowledge base with a reasoner, asked for conclusions.

    Args:
        base: the knowledge base.
        reasoner: does the analysis.

    Attributes:
        regions: the regions of measured values that the reasoner takes as one; none if it tells all values apart.
    """

    def __init__(self, base: KnowledgeBase, reasoner: Reasoner) -> None:
        self.base = base
        self.reasoner = reasoner
        self.regions: Regions | None = getattr(reasoner, "regions", None)
        self._memory: OrderedDict[tuple[KnowledgeState, bool], Conclusion] = OrderedDict()

    def conclude(self, state: KnowledgeState, *, improve_exceeded: bool = False) -> Conclusion:
        """Analyze a state and plan on it.

        Args:
            state: objectives, groundings, reported components and measured values.
            improve_exceeded: whether an objective is also adapted when a measured value exceeds what its present
                function design expects (the exemplar's revision 2023 does so in code).

        Raises:
            KnowledgeError: the state and the ontologies contradict one another.
        """
        key = (state, improve_exceeded)
        known = self._memory.get(key)
        if known is None:
            inference = self.reasoner.infer(state)
            to_adapt = dict(self._exceeded(state)) if improve_exceeded else {}
            decided = plan(self.base, state, inference, to_adapt=to_adapt)
            known = self._memory[key] = Conclusion(inference, decided, frozenset(_statuses(inference)))
            if len(self._memory) > REMEMBERED:
                self._memory.popitem(last=False)
        return known

    def _exceeded(self, state: KnowledgeState) -> Iterator[tuple[str, str]]:
        measured = dict(state.measurements)
        for function, design in state.groundings:
            for name, value in sorted(self.base.expected(design).items()):
                if name in measured and measured[name] > value:
                    yield function, f"{name} {measured[name]:.2f} exceeds what {design} expects"


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
