"""Derive facts: find the rules and facts that they follow from, as a tree.

All facts in a derivation are Pellet's, and so is what its built-ins say of their values. Where a fact follows in
several ways, the first one is shown, by the rule's name and then by the bindings. Pellet's own tracing picks another
one each time, and is asked only where neither a rule nor a single fact suffices.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from suave_des.kb.matching import Bound, Facts, matched, matches, shown_bindings, stated, with_bindings
from suave_des.knowledge.ontology import Content, Ontology, Terms
from suave_des.knowledge.pellet.in_process import (
    InProcessPellet,
    Trace,
    entailed,
    one_at_a_time,
    trace_contradiction,
)
from suave_des.knowledge.rdf import OWL, RDF_TYPE, Lit, Triple, canonical, fact_of, is_fact, n_triple
from suave_des.knowledge.rules import Atom, AtomKind, Rule
from suave_des.knowledge.state import Fact, KnowledgeState

_IRI: Final = re.compile(r"[a-z]+:[^\s,()]+")


@dataclass(frozen=True)
class Derivation:
    """How a fact follows.

    Attributes:
        fact: what follows.
        source: "state" or "ontology" where it is asserted, "rule", or "axioms" where it follows from the schema.
        rule: the rule's name.
        bindings: value of each of the rule's variables, by variable.
        axioms: the axioms of the schema that were used.
        premises: the facts of the rule's body, instantiated.
    """

    fact: Fact
    source: str
    rule: str | None = None
    bindings: Bound = ()
    axioms: tuple[str, ...] = ()
    premises: tuple[Derivation, ...] = ()

    def __str__(self) -> str:
        """As a tree of lines."""
        return "\n".join(self.lines())

    def lines(self, indent: str = "") -> Iterator[str]:
        """The fact and how it follows, and below it, indented, the facts that it follows from."""
        how = {
            "rule": f"by rule {self.rule}{with_bindings(self.bindings)}",
            "axioms": f"by the schema: {'; '.join(self.axioms)}" if self.axioms else "by the schema",
            "state": "given in the state",
            "ontology": "asserted in the ontology",
        }[self.source]
        yield f"{indent}{self.fact}  [{how}]"
        for premise in self.premises:
            yield from premise.lines(indent + "  ")

    def rules(self) -> frozenset[str]:
        """Names of all rules in it."""
        own = frozenset[str]() if self.rule is None else frozenset({self.rule})
        return own.union(*(premise.rules() for premise in self.premises))


@dataclass(frozen=True, eq=False)
class Tracer:
    """Derives the facts of one state.

    Attributes:
        state: whose facts are derived.
        pellet: made by `pellet_for`, for who asks about many states; None: one of its own.
    """

    base: Ontology
    state: KnowledgeState
    pellet: InProcessPellet | None = field(default=None, repr=False)
    _steps: dict[object, frozenset[Triple]] = field(default_factory=dict, repr=False)
    _found: dict[Triple, Derivation] = field(default_factory=dict, repr=False)

    @cached_property
    def asserted(self) -> frozenset[Triple]:
        """What ontologies and state assert."""
        return frozenset((*self.base.assertions(self.state), *self.base.content.triples))

    @cached_property
    def entailed(self) -> frozenset[Triple]:
        """All that follows in the state.

        Raises:
            KnowledgeError: the state contradicts itself.
        """
        return (self.pellet or pellet_for(self.base)).infer(self.base.assertions(self.state)) | self.asserted

    @cached_property
    def known(self) -> tuple[Triple, ...]:
        """All that follows and that rules mention, in canonical form and in a fixed order."""
        return tuple(sorted({_canonical(triple) for triple in self.entailed if is_fact(triple)}, key=str))

    @cached_property
    def _facts(self) -> Facts:
        return Facts(self.known)

    @cached_property
    def _leaves(self) -> dict[Triple, Triple]:
        """What is asserted, by its canonical form."""
        return {_canonical(triple): triple for triple in sorted(filter(is_fact, self.asserted), key=str)}

    @cached_property
    def _schema(self) -> Content:
        """The ontologies without facts about individuals; all rules keep their numbers."""
        content = self.base.content
        return replace(content, triples=tuple(each for each in content.triples if not is_fact(each)))

    def derive(self, triple: Triple) -> Derivation:
        """Derive a triple that is entailed."""
        with one_at_a_time:
            found = self._derive(_canonical(triple), frozenset())
            if found is None:  # the axioms that Pellet says that it follows from, without the steps between
                trace = self._trace(triple, self.asserted, self.base.content.enabled_rules)
                found = Derivation(self._fact(triple), "axioms", axioms=self._axioms(trace))
            return found

    def firings(self, rule: Rule) -> Iterator[tuple[Bound, tuple[Fact, ...]]]:
        """Find every way in which a rule fires: the bindings, and the facts that it concludes."""
        with one_at_a_time:
            for binding in matches(rule, self._facts):
                concluded = [triple for atom in rule.head if (triple := stated(atom, binding)) is not None]
                if all(_canonical(triple) in self._facts for triple in concluded):  # what is the same, Pellet knows
                    facts = tuple(map(self._fact, sorted(concluded, key=str)))
                    yield shown_bindings(binding, self.base.names), facts

    def _derive(self, triple: Triple, above: frozenset[Triple]) -> Derivation | None:
        """The first tree for a triple that does not depend on itself or on what is above it; None if there is none."""
        if triple in self._leaves:
            return self._leaf(self._leaves[triple])
        if triple not in self._found:
            inside = above | {triple}
            derivation = next(self._by_rules(triple, inside), None) or next(self._by_schema(triple, inside), None)
            if derivation is None:
                return None
            self._found[triple] = derivation
        return self._found[triple]

    def _by_rules(self, triple: Triple, above: frozenset[Triple]) -> Iterator[Derivation]:
        for rule in self.base.content.enabled_rules:
            starts = (matched(atom, triple, {}) for atom in rule.head)
            for start in (each for each in starts if each is not None):
                for binding in matches(rule, self._facts, start):
                    said = (stated(atom, binding) for atom in rule.body)
                    body = dict.fromkeys(_canonical(each) for each in said if each is not None)
                    if above.isdisjoint(body):
                        premises = tuple(found for each in body if (found := self._derive(each, above)) is not None)
                        if len(premises) == len(body):
                            bindings = shown_bindings(binding, self.base.names)
                            yield Derivation(self._fact(triple), "rule", rule.name, bindings, premises=premises)

    def _by_schema(self, triple: Triple, above: frozenset[Triple]) -> Iterator[Derivation]:
        """What follows from one other fact about the same thing: a class by a domain, an inverse, a sub-property."""
        kind: AtomKind = "class" if triple[1] == RDF_TYPE else "data" if isinstance(triple[2], Lit) else "object"
        asked = Atom(kind, str(triple[2]) if kind == "class" else triple[1], ())
        for other in self.known:
            about_same = {triple[0], triple[2]} & {other[0], other[2]}
            if about_same and other not in above and triple in self._concluded(other, asked):
                premise = self._derive(other, above)
                if premise is not None:
                    axioms = self._axioms(self._trace(triple, [other]))
                    yield Derivation(self._fact(triple), "axioms", premises=(premise,), axioms=axioms)

    def _concluded(self, fact: Triple, asked: Atom) -> frozenset[Triple]:
        """What Pellet says of the property or class of an atom, from a fact and the schema alone."""
        key = fact, asked
        if key not in self._steps:
            self._steps[key] = frozenset(map(_canonical, entailed(self._text([fact], ()), [asked])))
        return self._steps[key]

    def _text(self, facts: Iterable[Triple], rules: Sequence[Rule]) -> str:
        content = replace(self._schema, triples=(*self._schema.triples, *sorted(facts, key=str)))
        return content.n_triples(rules)

    def _trace(self, triple: Triple, facts: Iterable[Triple], rules: Sequence[Rule] = ()) -> Trace:
        """What Pellet says that a triple follows from."""
        return trace_contradiction(self._text(facts, rules) + _denial(triple))

    def _axioms(self, trace: Trace) -> tuple[str, ...]:
        """The axioms of the schema in a trace: domains, subclasses and the like."""
        schema = (each for each in trace.axioms if not each.startswith(("rule(", "prop(", "type(")))
        return tuple(_IRI.sub(lambda iri: self.base.names.short(iri.group()), each) for each in schema)

    def _leaf(self, triple: Triple) -> Derivation:
        return Derivation(self._fact(triple), "state" if triple in self.base.assertions(self.state) else "ontology")

    def _fact(self, triple: Triple) -> Fact:
        return fact_of(triple, self.base.names)


def pellet_for(base: Ontology) -> InProcessPellet:
    """Load an ontology into Pellet, to read all its terms and those that its rules mention."""
    terms = base.content.all_terms()
    atoms = [atom for rule in base.content.enabled_rules for atom in rule.atoms]
    properties = {atom.predicate for atom in atoms if atom.kind in ("object", "data")}
    classes = {atom.predicate for atom in atoms if atom.kind == "class"}
    return InProcessPellet(
        base, Terms(tuple(sorted(properties.union(terms.properties))), tuple(sorted(classes.union(terms.classes))))
    )


def _canonical(triple: Triple) -> Triple:
    return (*triple[:2], canonical(triple[2]))


def _denial(triple: Triple) -> str:
    """Say in OWL that a triple does not hold, as N-Triples."""
    subject, predicate, value = triple
    denied, restriction = "urn:denied", "urn:restriction"
    triples: list[Triple] = [
        (denied, OWL + "complementOf", value if predicate == RDF_TYPE else restriction),
        (denied, RDF_TYPE, OWL + "Class"),
        (subject, RDF_TYPE, denied),
    ]
    if predicate != RDF_TYPE:
        triples += [
            (restriction, RDF_TYPE, OWL + "Restriction"),
            (restriction, OWL + "onProperty", predicate),
            (restriction, OWL + "hasValue", value),
        ]
    return re.sub("<urn:(denied|restriction)>", r"_:\1", "".join(map(n_triple, triples)))
