"""Check that rules and facts use properties for the things that they are declared for (rdfs:domain, rdfs:range).

A reasoner contradicts no such use: it concludes that the thing is both, and a rule that needs both never fires.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final

from suave_des.knowledge.checks.findings import Finding, Level, finding_about
from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import OWL, RDF_TYPE, RDFS, TOMASYS, Lit, local_name, memberships, reached
from suave_des.knowledge.rules.syntax import Atom, Named, Rule, Term, Variable

#: Classes of which nothing is a member of two, unless an ontology or a rule says so.
_KINDS: Final = frozenset(
    TOMASYS + name
    for name in (
        *("Component", "Function", "FunctionDesign", "FunctionGrounding"),
        *("Objective", "QAvalue", "QualityAttributeType"),
    )
)


class Kinds:
    """What the properties of ontologies are declared for, as far as nothing is of two kinds."""

    def __init__(self, content: Content, model: Model) -> None:
        above = [
            (subject, str(value))
            for subject, predicate, value in content.triples
            if predicate in (RDFS + "subClassOf", OWL + "equivalentClass")
        ]
        above += [(other, one) for one, other in above if (one, OWL + "equivalentClass", other) in content.triples]
        self.of: dict[str, set[str]] = defaultdict(set)
        for individual, name in memberships(content.triples):
            self.of[individual] |= reached({name}, above) & _KINDS
        subclasses = [reached({name}, above) & _KINDS for name in {one for one, _ in above}]
        self._both = {pair for found in (*self.of.values(), *subclasses) for pair in combinations(sorted(found), 2)}
        self._free = content.head_classes() | {one for one in _KINDS if any(f"<{one}>" in x for x in content.structure)}
        groups = (("Objective", model.objectives), ("FunctionGrounding", model.groundings))
        for kind, individuals in (*groups, ("QAvalue", model.measurements)):
            for each in individuals.values():
                self.of[each.iri].add(TOMASYS + kind)
        declared: dict[tuple[str, int], set[str]] = defaultdict(set)
        for subject, predicate, value in content.triples:
            if predicate in (RDFS + "domain", RDFS + "range") and value in _KINDS:
                declared[subject, int(predicate == RDFS + "range")].add(str(value))
        #: More than one kind, by the property and the argument's number.
        self.mixed = {key: sorted(found) for key, found in declared.items() if self.exclude(*found)}
        #: Kind by the property and the argument's number.
        self.wanted = {key: min(found) for key, found in declared.items() if len(found) == 1}

    def exclude(self, *kinds: str) -> bool:
        """Whether nothing is of all these kinds."""
        return any(pair not in self._both and self._free.isdisjoint(pair) for pair in combinations(sorted({*kinds}), 2))


def misused_properties(content: Content, kinds: Kinds, sources: Sequence[OntologyFile]) -> Iterator[Finding]:
    """Find the properties that are declared for two kinds of things, and the facts with a thing of another kind."""
    for (name, number), found in sorted(kinds.mixed.items()):
        what = f"{local_name(name)} has {len(found)} {('domains', 'ranges')[number]}"
        message = f"{what}: what it is used for is concluded to be {' and '.join(map(local_name, found))} at once"
        yield finding_about(local_name(name), sources, Level.WARN, message, "keep one, or declare their union")
    for subject, predicate, value in content.triples:
        for number, thing in enumerate((subject, value)):
            wanted = kinds.wanted.get((predicate, number))
            known = kinds.of.get(thing, set()) if isinstance(thing, str) else set()
            if predicate == RDF_TYPE or isinstance(thing, Lit) or wanted is None or not known:
                continue
            if all(kinds.exclude(wanted, kind) for kind in known):
                fact = f"{local_name(predicate)} of {local_name(subject)}"
                message = (
                    f"{fact}: {local_name(thing)} is {with_article(min(known))}, but {with_article(wanted)} is needed"
                )
                yield finding_about(local_name(subject), sources, Level.WARN, message)


def mixed_terms(content: Content, kinds: Kinds) -> list[tuple[Rule, Atom, str, str]]:
    """Find the enabled rules in which a variable, or an individual, would have to be of two kinds at once.

    Returns:
        each rule with the atom that disagrees with those before, what is wrong, and what the property is for.
    """
    found = []
    for rule in content.enabled_rules:
        known: dict[Term, tuple[str, str]] = {}
        reported: set[Term] = set()
        for atom, term, kind in uses(rule, kinds):
            name = local_name(atom.predicate)
            if isinstance(term, Named) and term not in known and (own := kinds.of.get(term.iri)):
                known[term] = min(own), ""
            before, by = known.setdefault(term, (kind, "" if atom.kind == "class" else name))
            if kinds.exclude(before, kind) and term not in reported:
                reported.add(term)
                thing = f"?{term.name}" if isinstance(term, Variable) else local_name(getattr(term, "iri", ""))
                first = with_article(before) + (f" in {by}" if by else "")
                found.append((rule, atom, f"{thing} is {first}, but {with_article(kind)} in {name}", _use(atom, kinds)))
    return found


def uses(rule: Rule, kinds: Kinds) -> Iterator[tuple[Atom, Term, str]]:
    """(atom, argument, kind) wherever a rule needs a thing of a kind; classes in heads are conclusions."""
    for atom in rule.body:
        if atom.kind == "class" and atom.predicate in _KINDS and len(atom.arguments) == 1:
            yield atom, atom.arguments[0], atom.predicate
    for atom in rule.atoms:
        if atom.kind in ("object", "data"):
            for number, term in enumerate(atom.arguments):
                kind = kinds.wanted.get((atom.predicate, number))
                if kind is not None and not isinstance(term, Lit):
                    yield atom, term, kind


def _use(atom: Atom, kinds: Kinds) -> str:
    """What a property is for."""
    subject, value = (kinds.wanted.get((atom.predicate, number)) for number in (0, 1))
    if subject is None:
        return ""
    name = local_name(atom.predicate)
    return (
        f"{name} leads from {with_article(subject)} to {with_article(value)}"
        if value
        else f"{name} is a property of {with_article(subject)}"
    )


def with_article(iri: str) -> str:
    """Write the name of a class with its article."""
    name = local_name(iri)
    return f"{'an' if name[0] in 'AEIO' else 'a'} {name}"
