"""Plan: choose a function design for each objective that needs one (the third step of the MAPE-K loop).

The planner reads facts, asserted and inferred; the rules are the reasoner's. Source: the exemplar's Metacontrol (paper,
section on Metacontrol; repository kas-lab/suave). Unlike there, the filter by required values is in force.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from itertools import product
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import OPERATORS, Ontology
from suave_des.knowledge.rdf import PERFORMANCE, local_name
from suave_des.knowledge.state import (
    NO_GROUNDING,
    UNGROUNDED,
    Decision,
    Inference,
    KnowledgeState,
    ObjectiveState,
    Plan,
    Rejection,
    objective_name,
)

#: Performance of a design for which none is given.
DEFAULT_PERFORMANCE: Final = Decimal("0.001")
_PERFORMANCE: Final = local_name(PERFORMANCE)
#: Statuses that trigger adaptation, besides all that start with IN_ERROR_; the last three occur in older files.
_TRIGGERS: Final = frozenset({UNGROUNDED, "INTERNAL_ERROR", "EXTERNAL_ERROR", "UPDATABLE"})


def plan(ontology: Ontology, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
    """Decide on every objective that is ungrounded, in error, updatable or always to be improved.

    Args:
        inference: what the reasoner added to the state that was analyzed.
        improve_exceeded: whether an objective is also adapted when a measured value exceeds what its current function
            design expects (the exemplar's revision 2023 does so in code).

    Raises:
        KnowledgeError: an objective requires a value of a quality attribute type without comparison operator.
    """
    decisions = []
    exceeded = dict(_exceeded(ontology, inference.state)) if improve_exceeded else {}
    for objective in inference.state.objectives:
        trigger = _trigger(objective, inference) or exceeded.get(objective.function)
        if trigger is not None:
            decisions.append(_decide(ontology, inference, objective.function, trigger))
    return Plan(tuple(decisions))


def _exceeded(ontology: Ontology, state: KnowledgeState) -> Iterator[tuple[str, str]]:
    """Functions whose current design expects less than the measured value, each with the reason to adapt it."""
    measured = dict(state.measurements)
    for function, design in state.groundings:
        for name, value in sorted(ontology.expected(design).items()):
            if name in measured and measured[name] > value:
                yield function, f"{name} {measured[name]:.2f} exceeds what {design} expects"


def triggers_adaptation(status: str) -> bool:
    """Whether an objective of a status (o_status) is adapted."""
    return status in _TRIGGERS or status.startswith("IN_ERROR_")


def _trigger(objective: ObjectiveState, inference: Inference) -> str | None:
    """Return why an objective is adapted; None if it need not be."""
    name = objective_name(objective.function)
    for status in map(str, inference.values(name, "o_status")):
        if triggers_adaptation(status):
            return f"o_status {status}"
    if True in inference.values(name, "o_updatable"):
        return "updatable"
    return "always to be improved" if True in inference.values(name, "o_always_improve") else None


def _decide(ontology: Ontology, inference: Inference, function: str, trigger: str) -> Decision:
    designs = [name for name in inference.subjects("solvesF", function) if name in ontology.model.designs]
    reasons = {design: next(_rejection_reasons(inference, design, function), None) for design in designs}
    rejected = tuple(Rejection(design, reason) for design, reason in reasons.items() if reason is not None)
    eligible = {design: performance(inference, design) for design, reason in reasons.items() if reason is None}
    if not eligible:
        current = inference.state.grounded(function)
        kept = f"{current} is kept" if current else f"it stays {NO_GROUNDING}"
        return Decision(function, None, f"{trigger}: no function design is left, {kept}", rejected)
    best = min(eligible, key=lambda design: (-eligible[design], design))
    among = f"among {len(eligible)} eligible of {len(designs)} designs"
    reason = f"{trigger}: highest performance ({_show(eligible[best])}) {among}"
    return Decision(function, best, reason, rejected)


def _rejection_reasons(inference: Inference, design: str, function: str) -> Iterator[str]:
    """Yield the reasons why a function design must not be chosen now."""
    objective = objective_name(function)
    if False in inference.values(design, "fd_realisability"):
        yield "not realisable"
    if objective in inference.values(design, "fd_error_log"):
        yield f"{objective} is in its error log"
    for attribute, required in _values(inference, objective, "hasNFR"):
        signs = _operators(inference, attribute)
        if not signs:
            raise KnowledgeError(
                f"{objective} requires a value of {attribute}, which has no qa_comparison_operator",
                remedy=f"give {attribute} one of {' '.join(OPERATORS)}: "
                "the way in which a value is worse than the required one",
            )
        for expected, sign in product(_expected(inference, design, attribute), signs):
            if OPERATORS[sign](expected, required):
                left, right = _show_pair(expected, required)
                yield f"{attribute} {left} expected {sign} {right} required"
    for attribute, expected in _values(inference, design, "hasQAestimation"):
        for measured in inference.state.measured(attribute):
            for sign in _operators(inference, attribute):
                if OPERATORS[sign](measured, expected):
                    left, right = _show_pair(measured, expected)
                    yield f"{attribute} {left} measured {sign} {right} expected"


def _values(inference: Inference, subject: str, property_name: str) -> Iterator[tuple[str, Decimal]]:
    """(quality attribute type, value) of the QAvalue individuals that a property leads to."""
    for individual in inference.values(subject, property_name):
        for attribute in inference.values(str(individual), "isQAtype"):
            for value in inference.values(str(individual), "hasValue"):
                if isinstance(value, Decimal):
                    yield str(attribute), value


def _expected(inference: Inference, design: str, attribute: str) -> list[Decimal]:
    """Expected values of one quality attribute; a missing performance is the default, as in the choice."""
    found = [value for name, value in _values(inference, design, "hasQAestimation") if name == attribute]
    return found or ([DEFAULT_PERFORMANCE] if attribute == _PERFORMANCE else [])


def _operators(inference: Inference, attribute: str) -> list[str]:
    """Return the operators by which a value of a quality attribute is worse than an expected one; usually one."""
    return [sign for sign in map(str, inference.values(attribute, "qa_comparison_operator")) if sign in OPERATORS]


def performance(inference: Inference, design: str) -> Decimal:
    """The design's expected performance, which the planner maximises."""
    return max(_expected(inference, design, _PERFORMANCE))


def _show(value: Decimal, digits: int = 2) -> str:
    """Write a number with two digits, or up to `digits` of them that are not zero at the end."""
    whole, _, part = f"{value:.{digits}f}".partition(".")
    return f"{whole}.{part[:2]}{part[2:].rstrip('0')}"


def _show_pair(one: Decimal, other: Decimal) -> tuple[str, str]:
    """Write two numbers with as many digits as it takes to distinguish them."""
    shown = ((_show(one, digits), _show(other, digits)) for digits in range(2, 17))
    return next((pair for pair in shown if pair[0] != pair[1] or one == other), (str(one), str(other)))
