"""Decides all states of a space, each kind once."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from suave_des.errors import KnowledgeError
from suave_des.kb.effects import has_effect, regions_by_attribute
from suave_des.kb.situations import Decide, OnCount, Situation
from suave_des.kb.space import PolicySpace, States
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import KnowledgeState


def kind_of(base: Ontology, space: PolicySpace) -> Callable[[KnowledgeState], Hashable]:
    """Make a function that returns what the decision in a state can depend on: the same for all
    decided alike.
    """
    functions = {*base.functions, *space.functions}
    effects = {
        each: [name for name in space.attributes if has_effect(base, name, each)]
        for each in functions
    }
    regions = regions_by_attribute(base, space.attributes)

    def kind(state: KnowledgeState) -> Hashable:
        relevant = {name for each in state.objectives for name in effects[each.function]}
        seen = tuple(
            (name, value if regions is None else regions[name].region(value))
            for name, value in state.measurements
            if name in relevant
        )
        return state.objectives, state.groundings, state.components, seen

    return kind


def decide_all(base: Ontology, states: States, decide: Decide, on_count: OnCount) -> Decide:
    """Decide every state; those that differ in nothing on which a decision can depend, once.

    Args:
        base: the ontologies and rules.
        states: to decide.
        decide: concludes what follows and is decided in a situation.
        on_count: called with how many kinds of states have been inferred, first 0, and how many
            have to be.

    Returns:
        what is decided in each of the states; a contradiction is told with the values of another
        one of its kind.

    Raises:
        KnowledgeError: there is nothing to decide, or the reasoner takes too long.
    """
    if not any(map(base.designs, base.functions)):
        problem = "no function has a function design, so there is nothing to decide"
        remedy = "give an ontology that uses TOMASys as suave.owl does"
        raise KnowledgeError(problem, file=", ".join(map(str, base.files)), remedy=remedy)
    kind = kind_of(base, states.space)
    different: dict[Hashable, KnowledgeState] = {}
    decided = {}
    for state in states:
        different.setdefault(kind(state), state)
    on_count(0, len(different))
    for key, state in different.items():
        decided[key] = decide(Situation(state))
        on_count(len(decided), len(different))
    return lambda situation: decided[kind(situation.state)]
