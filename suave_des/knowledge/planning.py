"""Plan: choose a function design for each objective that needs one (the loop's third step).

The planner reads facts, asserted and inferred; what the rules say is left to the reasoner. Source: the
exemplar's Metacontrol (paper, section on Metacontrol; repository kas-lab/suave). Unlike there, the filter by
required values counts.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from types import MappingProxyType
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import UNGROUNDED, Decision, Inference, KnowledgeState, ObjectiveState, Plan, Rejection
from suave_des.knowledge.vocabulary import PERFORMANCE, objective_name

#: What a design without a performance counts.
DEFAULT_PERFORMANCE: Final = Decimal("0.001")
#: Statuses that call for adaptation, besides all that start with IN_ERROR_; the last three are of older files.
_CALLING: Final = frozenset({UNGROUNDED, "INTERNAL_ERROR", "EXTERNAL_ERROR", "UPDATABLE"})
_COMPARE: Final[Mapping[str, Callable[[Decimal, Decimal], bool]]] = MappingProxyType(
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
)


def plan(
    ontology: Ontology, state: KnowledgeState, inference: Inference, *, to_adapt: Mapping[str, str] | None = None
) -> Plan:
    """Decide on every objective that is ungrounded, in error, updatable or always to be improved.

    Args:
        ontology: the knowledge base.
        state: the state that was reasoned about.
        inference: what the reasoner added to it.
        to_adapt: functions whose objectives are adapted whatever their status, each with the reason.

    Raises:
        KnowledgeError: an objective requires a value of a quality attribute type without comparison operator.
    """
    decisions = []
    for objective in state.objectives:
        call = _call(objective, inference) or (to_adapt or {}).get(objective.function)
        if call is not None:
            decisions.append(_decide(ontology, inference, objective.function, call))
    return Plan(tuple(decisions))


def calls(status: str) -> bool:
    """Whether an objective of a status (o_status) is adapted."""
    return status in _CALLING or status.startswith("IN_ERROR_")


def _call(objective: ObjectiveState, inference: Inference) -> str | None:
    """Why an objective is adapted; None when it need not be."""
    name = objective_name(objective.function)
    for status in map(str, inference.values(name, "o_status")):
        if calls(status):
            return f"o_status {status}"
    if True in inference.values(name, "o_updatable"):
        return "updatable"
    return "always to be improved" if True in inference.values(name, "o_always_improve") else None


def _decide(ontology: Ontology, inference: Inference, function: str, call: str) -> Decision:
    designs = [name for name in inference.subjects("solvesF", function) if name in ontology.model.designs]
    rejected = []
    left = []
    for design in designs:
        reason = next(_objections(inference, design, function), None)
        if reason is None:
            left.append(design)
        else:
            rejected.append(Rejection(design, reason))
    if not left:
        present = inference.state.grounded(function)
        kept = f"{present} is kept" if present else "it stays ungrounded"
        return Decision(function, None, f"{call}: no function design is left, {kept}", tuple(rejected))
    best = min(left, key=lambda design: (-performance(ontology, inference, design), design))
    shown = _show(performance(ontology, inference, best))
    reason = f"{call}: highest performance, {shown}, of {len(left)} left among {len(designs)}"
    return Decision(function, best, reason, tuple(rejected))


def _objections(inference: Inference, design: str, function: str) -> Iterator[str]:
    """Why a function design must not be chosen now, the first reason first."""
    objective = objective_name(function)
    if False in inference.values(design, "fd_realisability"):
        yield "not realisable"
    if objective in inference.values(design, "fd_error_log"):
        yield f"{objective} is in its error log"
    for attribute, required in _values(inference, objective, "hasNFR"):
        compare, sign = _operator(inference, attribute, objective)
        for expected in _expected(inference, design, attribute):
            if compare(expected, required):
                left, right = _show_pair(expected, required)
                yield f"{attribute} {left} expected {sign} {right} required"
    for attribute, expected in _values(inference, design, "hasQAestimation"):
        for measured in inference.state.measured(attribute):
            signs = [str(sign) for sign in inference.values(attribute, "qa_comparison_operator")]
            for sign in signs:
                if sign in _COMPARE and _COMPARE[sign](measured, expected):
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
    """Expected values of one quality attribute; a missing performance counts as in the choice."""
    found = [value for name, value in _values(inference, design, "hasQAestimation") if name == attribute]
    return found or ([DEFAULT_PERFORMANCE] if attribute == "performance" else [])


def _operator(inference: Inference, attribute: str, objective: str) -> tuple[Callable[[Decimal, Decimal], bool], str]:
    for sign in map(str, inference.values(attribute, "qa_comparison_operator")):
        if sign in _COMPARE:
            return _COMPARE[sign], sign
    raise KnowledgeError(
        f"{objective} requires a value of {attribute}, which has no qa_comparison_operator",
        remedy=f"give {attribute} one of {' '.join(_COMPARE)}: the way in which a value is worse than the required one",
    )


def performance(ontology: Ontology, inference: Inference, design: str) -> Decimal:
    """What the planner maximises: the design's expected performance."""
    name = ontology.names.short(PERFORMANCE)
    return max(
        (value for kind, value in _values(inference, design, "hasQAestimation") if kind == name),
        default=DEFAULT_PERFORMANCE,
    )


def _show(value: Decimal, digits: int = 2) -> str:
    """A number with that many digits, of which those after the second are left out where they are zero."""
    whole, _, part = f"{value:.{digits}f}".partition(".")
    return f"{whole}.{part[:2]}{part[2:].rstrip('0')}"


def _show_pair(one: Decimal, other: Decimal) -> tuple[str, str]:
    """Two numbers with two digits, or with as many as it takes to tell them apart."""
    for digits in range(2, 17):
        shown = _show(one, digits), _show(other, digits)
        if shown[0] != shown[1] or one == other:
            return shown
    return str(one), str(other)
