"""Check an ontology and its rules against missions: what monitors report of components, and what they measure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from difflib import get_close_matches
from operator import eq, ne
from typing import Final

from suave_des.errors import nearest
from suave_des.knowledge.checks.findings import Finding, Level, finding_about
from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import C_STATUS, PERFORMANCE, QA_OPERATOR, SWRLB, XSD, Lit, local_name
from suave_des.knowledge.rules.syntax import COMPARISON_OF, COMPARISONS, Atom, Rule, Variable

#: Whether a built-in holds for a text and the one that a rule names.
_HOLDS: Final[Mapping[str, Callable[[str, str], bool]]] = {
    COMPARISON_OF["="]: eq,
    COMPARISON_OF["!="]: ne,
    SWRLB + "stringEqualIgnoreCase": lambda text, named: text.casefold() == named.casefold(),
    SWRLB + "contains": lambda text, named: named in text,
    SWRLB + "containsIgnoreCase": lambda text, named: named.casefold() in text.casefold(),
    SWRLB + "startsWith": lambda text, named: text.startswith(named),
    SWRLB + "endsWith": lambda text, named: text.endswith(named),
}


def unreported_components(
    content: Content, model: Model, sources: Sequence[OntologyFile], reported: Collection[str]
) -> Iterator[Finding]:
    """Find the components whose status no mission can have: nothing reports, asserts or concludes it."""
    if C_STATUS in content.head_properties():
        return
    asserted = {subject for subject, predicate, _ in content.triples if predicate == C_STATUS}
    for name, iri in sorted(model.components.items()):
        if name not in reported and iri not in asserted:
            message = f"nothing in the simulation reports the status of component {name}, so missions never have one"
            yield finding_about(name, sources, Level.INFO, message, f"reported are {', '.join(reported)}")


def unreported_statuses(content: Content, reported: Collection[str]) -> list[tuple[Rule, Atom, str]]:
    """Find the rules that ask for a component's status that nothing reports, asserts or concludes: the status, last."""
    asserted = [value for _, predicate, value in content.triples if predicate == C_STATUS]
    rules = content.enabled_rules
    concluded = [atom.arguments[-1] for rule in rules for atom in rule.head if atom.predicate == C_STATUS]
    known = {*reported, *(value.text for value in (*asserted, *concluded) if isinstance(value, Lit))}
    if any(isinstance(value, Variable) for value in concluded):
        return []
    asked = [(rule, atom, atom.arguments[-1]) for rule in rules for atom in rule.body if atom.predicate == C_STATUS]
    for rule, _, status in tuple(asked):  # and in a comparison
        if isinstance(status, Variable):
            tests = [each for each in rule.body if each.predicate in _HOLDS and status in each.arguments]
            is_either = COMPARISONS.keys()  # the other built-ins ask something of their first argument
            tests = [each for each in tests if each.predicate in is_either or each.arguments[0] == status]
            asked += [(rule, atom, term) for atom in tests for term in atom.arguments]
    return [
        (rule, atom, status.text)
        for rule, atom, status in asked
        if isinstance(status, Lit) and status.datatype == XSD + "string" and _is_unknown(atom, status.text, known)
    ]


def _is_unknown(atom: Atom, text: str, known: Collection[str]) -> bool:
    """Whether a text is none of the known ones, as an atom compares it; one that it excludes must be misspelt."""
    if atom.predicate == COMPARISON_OF["!="]:
        return text not in known and did_you_mean_text(text, known) is not None
    test = _HOLDS[atom.predicate if atom.predicate in _HOLDS else COMPARISON_OF["="]]
    return not any(test(each, text) for each in known)


def did_you_mean_text(text: str, known: Collection[str]) -> str | None:
    """Return the known text that is probably meant; None if there is none."""
    by_capitals = {each.upper(): each for each in sorted(known)}
    found = get_close_matches(text.upper(), by_capitals, n=1)
    return by_capitals[found[0]] if found else None


def mismatched_attributes(
    content: Content, model: Model, sources: Sequence[OntologyFile], measured: Collection[str]
) -> Iterator[Finding]:
    """Find quality attributes that missions measure and no ontology has, and those that designs require, unmeasured."""
    for name in sorted(set(measured).difference(model.attributes)):
        message = f"missions measure {name}, but no ontology has a quality attribute type of this name"
        yield Finding(Level.WARN, message, file=str(sources[0].path), remedy=nearest(name, model.attributes))
    compared = {subject for subject, predicate, _ in content.triples if predicate == QA_OPERATOR}
    required = {name for names in model.estimated.values() for name in names} - {local_name(PERFORMANCE)}
    for name in sorted(required.difference(measured)):
        if model.attributes[name] in compared:
            message = f"missions do not measure {name}, so what designs expect of it is compared with nothing"
            yield finding_about(name, sources, Level.INFO, message)
