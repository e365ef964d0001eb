"""Compare what decision tables decide in every state, with each other or with a knowledge base."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial, reduce

from suave_des.errors import InputError, did_you_mean, line_error, shown
from suave_des.kb.deciding import decide_all
from suave_des.kb.decision_table import DecisionTable
from suave_des.kb.difference import PolicyDifference, compare_decisions
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.situations import Decide, OnCount, Outcome, Situation
from suave_des.kb.space import PolicySpace, States
from suave_des.knowledge.ontology import Ontology


def compare_deciders(
    knowledge: KnowledgeBase,
    both: Sequence[KnowledgeBase | DecisionTable],
    max_failed: int,
    on_count: OnCount,
) -> PolicyDifference:
    """Compare what two tables, or a table and a knowledge base, decide in every state that either
    can tell apart.

    Args:
        knowledge: has the tasks and designs of the states.
        max_failed, on_count: as of KnowledgeBase.policy.

    Raises:
        InputError: there would be too many states, or a table has no row for one of them, or a
            design that the knowledge base does not have.
        KnowledgeError: the reasoner takes too long for one of them.
    """
    space = reduce(PolicySpace.union, (each.space for each in both), knowledge.space)
    states = States.of(knowledge.base, knowledge.settings, max_failed, space)
    decide: list[Decide] = []
    bases = []
    for each in both:
        if isinstance(each, DecisionTable):
            _check_designs(each, knowledge.base)
            decide.append(partial(_outcome, each))
        else:
            decide.append(decide_all(each.base, states, each.outcome, on_count))
            bases.append(each.base)
    return compare_decisions(states, decide[0], decide[1], bases, infer=False)


def _outcome(table: DecisionTable, situation: Situation) -> Outcome:
    try:
        return table.outcome(situation)
    except InputError as error:
        remedy = "kb diff compares all designs of the ontology as now: add a row, or write any"
        raise InputError(error.problem, file=error.file, place=error.place, remedy=remedy) from None


def _check_designs(table: DecisionTable, base: Ontology) -> None:
    for function, designs in table.designs.items():
        for design, line in designs.items():
            if design not in base.designs(function):
                problem = f"the ontology has no design {shown(design)} of {function}"
                remedy = did_you_mean(design, base.designs(function))
                raise line_error(table.path, line, problem, remedy)
