"""Check the numbers that rules compare measured values with: of some, missions know only one outcome."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from suave_des.knowledge.content import Content
from suave_des.knowledge.rdf import HAS_QA_VALUE, HAS_VALUE, IS_QA_TYPE, NUMERIC, Lit, local_name
from suave_des.knowledge.rules.syntax import COMPARISONS, Atom, Named, Rule, Term

_COMPARE: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def decided_comparisons(
    content: Content, ranges: Mapping[str, tuple[float, float]]
) -> Iterator[tuple[Rule, Atom, str, str]]:
    """Find the comparisons of a grounding's value (hasQAvalue) with a number that always, or never, hold in missions.

    Args:
        content: the ontologies and rules.
        ranges: the smallest and the greatest value that missions measure, by quality attribute.

    Yields:
        rule, comparison, quality attribute, and "always" or "never".
    """
    if content.head_properties() & {HAS_QA_VALUE, IS_QA_TYPE, HAS_VALUE}:
        return  # groundings have values from elsewhere, too
    for rule in content.enabled_rules:
        attributes = _measured(rule)
        for atom in rule.body:
            if atom.predicate not in COMPARISONS or len(atom.arguments) != 2:
                continue
            compared = [attributes[term] for term in atom.arguments if term in attributes]
            numbers = [
                float(term.text) for term in atom.arguments if isinstance(term, Lit) and term.datatype in NUMERIC
            ]
            if len(compared) == len(numbers) == 1 and compared[0] in ranges:
                (attribute,), (number,) = compared, numbers
                low, high = ranges[attribute]
                compare = _COMPARE[COMPARISONS[atom.predicate]]
                is_first = atom.arguments[0] in attributes
                outcomes = {
                    compare(value, number) if is_first else compare(number, value)
                    for value in (low, high, min(max(number, low), high))
                }
                if len(outcomes) == 1:
                    yield rule, atom, attribute, "always" if outcomes.pop() else "never"


def _measured(rule: Rule) -> dict[Term, str]:
    """Return the variables of a rule that stand for the number of a grounding's value, with its quality attribute."""
    pairs = [(atom.predicate, *atom.arguments) for atom in rule.body if len(atom.arguments) == 2]
    values = {term for predicate, _, term in pairs if predicate == HAS_QA_VALUE}
    types = {
        value: local_name(attribute.iri)
        for predicate, value, attribute in pairs
        if predicate == IS_QA_TYPE and value in values and isinstance(attribute, Named)
    }
    return {number: types[value] for predicate, value, number in pairs if predicate == HAS_VALUE and value in types}
